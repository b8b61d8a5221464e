// Starts drives (NMT start), including nodes that still hold an error from an earlier session.
//
// After a controller has vanished, a node may keep an error (EMCY 8100h: SYNC missing; 8130h: heartbeat lost) and
// refuse NMT start while its error register (1001h) shows this error. CANopenNode does so (its issues 26, 374 and 507):
// newer versions until SYNC and heartbeat are back, older versions until their communication is reset. These remedies
// are tried in turn and reported:
// 1. A fault reset by SDO: 6040h = 0000h, 0080h, 0000h. These values don't enable the drive.
// 2. SYNC and the controller's heartbeat are sent during NMT start. They then pause until the first cycle, and the
//    drive must not trip in that pause. Therefore 1006h is set to 0 before NMT start and stays 0. 1016h:01 is written
//    again after NMT start, so the drive watches the heartbeat only from the cycle's first heartbeat on.
// 3. NMT reset communication (82h) for that node alone. The node is then configured again.
// A node without an error gets the full nmt_timeout_ns to start.
#pragma once

#include <functional>
#include <span>

#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

// Configures drives that are pre-operational; throws SetupError.
using ConfigureAnew = std::function<void(std::span<const DriveSlot>)>;

// Starts the drives. On return, all drives are operational. Otherwise throws SetupError that names the first drive that
// didn't start, its error and the remedies tried.
void start_drives(CanNetwork& network, std::span<const DriveSlot> drives, const FrameHandler& handler,
                  const ConfigureAnew& configure_anew, const Tell& tell);

}  // namespace proxarm::fieldbus
