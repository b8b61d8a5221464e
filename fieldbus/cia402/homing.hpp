// Before the first session: a drive's position asked for, and the homing of an incremental encoder (CiA 402, mode 6).
//
//   6060h = 6; 6098h method, 6099h:01/02 speeds, 609Ah acceleration, 607Ch home offset 0
//   6040h: 06, 07, 0F, then 1F: bit 4 starts. 6041h: bit 12 homing attained and bit 10 target reached; bit 13 error
// All by SDO, one drive at a time, with the controller's heartbeat beside it, so that a drive whose controller dies
// stops (1016h, 6007h). The position at home is 0 then, whatever a maker takes the sign of 607Ch for.
#pragma once

#include <cstdint>
#include <functional>

#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

// 6064h, or what the cell has in its place. Nothing is written. Throws SetupError.
[[nodiscard]] std::int32_t read_position(CanNetwork& network, const DriveSlot& drive, const FrameHandler& other = {});

// Homes it and leaves it switched off, with `homed_token` in 1020h:01; then a session takes it. `may_move` is asked
// every 10 ms; false stops it. Throws SetupError that says what the drive doesn't do; it is switched off then, too.
// Precondition: its description has `homing`.
void home(CanNetwork& network, const DriveSlot& drive, const std::function<bool()>& may_move,
          const FrameHandler& other = {});

}  // namespace proxarm::fieldbus
