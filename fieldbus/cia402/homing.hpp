// For commissioning: reads a drive's position, and homes an incremental encoder (CiA 402, mode 6).
//
//   6060h = 6; 6098h method, 6099h:01/02 speeds, 609Ah acceleration, 607Ch home offset 0
//   6040h: 06, 07, 0F, then 1F: bit 4 starts. 6041h: bit 12 homing attained and bit 10 target reached; bit 13 error
// All by SDO, one drive at a time. The controller's heartbeat is sent meanwhile, so that the drive stops if the
// controller dies (1016h, 6007h). The home position is then 0, independent of the sign that the maker gives 607Ch.
#pragma once

#include <cstdint>
#include <functional>

#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

// Reads 6064h, or the object that the cell has in its place. Writes nothing. Throws SetupError.
[[nodiscard]] std::int32_t read_position(CanNetwork& network, const DriveSlot& drive, const FrameHandler& other = {});

// Homes the drive and leaves it switched off, with `homed_token` in 1020h:01, which a session requires. `may_move` is
// called every 10 ms; false stops the motion. Throws SetupError; the drive is then switched off as well. Precondition:
// the description has `homing`.
void home(CanNetwork& network, const DriveSlot& drive, const std::function<bool()>& may_move,
          const FrameHandler& other = {});

}  // namespace proxarm::fieldbus
