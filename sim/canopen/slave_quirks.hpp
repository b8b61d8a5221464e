// Deviations of a simulated CANopen slave from CiA 301, and effects of a bad line.
#pragma once

#include <cstdint>

namespace proxarm::sim {

struct SlaveQuirks {
  bool mutes_heartbeat = false;
  bool mutes_sdo = false;
  bool has_twin = false;           // another node has its number: each transmit PDO is sent twice, with two positions
  bool toggles_heartbeat = false;  // bit 7 of its state toggles, as in node guarding
  bool sdo_sizeless = false;       // expedited read answers don't give their size (42h): always four bytes
  bool sdo_doubled = false;        // each SDO answer is sent twice
  bool sdo_stray = false;          // before each SDO answer, sends one for another object
  std::int64_t sdo_late_ns = 0;    // additional delay of each SDO answer
  std::uint32_t hears_no_sync_in = 0;  // it misses one of this many SYNCs; 0: none
  int tpdo_bytes = -1;                 // length of its transmit PDOs; −1: as mapped
};

}  // namespace proxarm::sim
