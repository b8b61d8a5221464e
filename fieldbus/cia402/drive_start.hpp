// Starts drives (NMT start), including nodes that still hold an error of an earlier session.
//
// After a controller vanished, a node may keep an error (EMCY 8100h, SYNC missing; 8130h, heartbeat lost) and refuse
// NMT start while its error register (1001h) shows it. CANopenNode does (its issues 26, 374 and 507): newer versions
// until SYNC and heartbeat are back, older ones until their communication is reset. These remedies are tried in turn,
// and reported:
//   1. a fault reset by SDO: 6040h = 0000h, 0080h, 0000h, none of which enables the drive
//   2. SYNC and the controller's heartbeat during NMT start. They end again until the first cycle, so the drive must
//      not watch for them: 1006h is set to 0 before, and stays 0; 1016h:01 is written again after, and watches from the
//      cycle's first heartbeat on
//   3. NMT reset communication (82h) for that node alone, which is then configured again
// A node without an error gets the full time to start instead.
#pragma once

#include <functional>
#include <span>

#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

// Configures drives that are pre-operational; throws SetupError.
using ConfigureAnew = std::function<void(std::span<const DriveSlot>)>;

// All drives are operational on return. Throws SetupError that names the first drive that isn't, its error and the
// remedies tried.
void start_drives(CanNetwork& network, std::span<const DriveSlot> drives, const FrameHandler& handler,
                  const ConfigureAnew& configure_anew, const Tell& tell);

}  // namespace proxarm::fieldbus
