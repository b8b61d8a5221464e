// For commissioning: reads a drive's position, and homes an incremental encoder (CiA 402, mode 6).
//
//   6060h = 6; 6098h method, 6099h:01/02 speeds, 609Ah acceleration, 607Ch home offset 0
//   6040h: 06, 07, 0F, then 1F: bit 4 starts the homing
//   6041h: bit 12 homing attained, bit 10 target reached, bit 13 homing error
// All objects are accessed by SDO, one drive at a time. The controller's heartbeat is sent meanwhile, so that the drive
// stops if the controller dies (1016h, 6007h). The home offset is 0, so the home position is 0 counts, whatever sign
// the maker gives 607Ch.
#pragma once

#include <cstdint>
#include <functional>

#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

// Reads the position from 6064h, or from the object that the cell names instead. Writes nothing. Throws SetupError.
[[nodiscard]] std::int32_t read_position(CanNetwork& network, const DriveSlot& drive, const FrameHandler& other = {});

// Homes the drive, leaves it switched off and writes `homed_token` to 1020h:01, which a session requires. `may_move` is
// called every 10 ms; if it returns false, the drive is switched off. Throws SetupError if homing fails; the drive is
// then switched off too. Precondition: the description has `homing`.
void home(CanNetwork& network, const DriveSlot& drive, const std::function<bool()>& may_move,
          const FrameHandler& other = {});

}  // namespace proxarm::fieldbus
