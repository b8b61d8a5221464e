// NMT start, also for a node that holds something from the life before.
//
// After a controller that vanished a node may keep an error (EMCY 8100h, SYNC missing; 8130h, heartbeat lost) and
// refuse NMT start while its error register (1001h) shows it. CANopenNode does (its issues 26, 374 and 507): its newer
// versions until SYNC and heartbeat are back, its older ones until their communication is reset. Such a node is helped
// by the mildest means that works, each of them told:
//   1. a fault reset by SDO: 6040h = 0000h, 0080h, 0000h, none of which enables anything
//   2. SYNC and the controller's heartbeat while it is started. They end again until the first cycle, so the drive must
//      not watch for them: 1006h is 0 before, and stays so; 1016h:01 is written anew after, and watches from the
//      cycle's first heartbeat on
//   3. NMT reset communication (82h) for that node alone, which is then configured anew
// A node that holds nothing, or says nothing of it, isn't helped: it has its whole time to start.
#pragma once

#include <functional>
#include <span>

#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

// Configures drives that are pre-operational; throws SetupError.
using ConfigureAnew = std::function<void(std::span<const DriveSlot>)>;

// All are operational when it returns. Throws SetupError that names the first that isn't, what it holds and what was
// tried.
void start_drives(CanNetwork& network, std::span<const DriveSlot> drives, const FrameHandler& handler,
                  const ConfigureAnew& configure_anew, const Tell& tell);

}  // namespace proxarm::fieldbus
