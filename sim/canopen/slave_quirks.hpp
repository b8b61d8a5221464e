// Deviations of a simulated CANopen slave from CiA 301, and the effects of a bad line.
#pragma once

#include <cstdint>

namespace proxarm::sim {

struct SlaveQuirks {
  bool mutes_heartbeat = false;
  bool mutes_sdo = false;
  // Another node has the same number: each transmit PDO is sent twice, with two different positions.
  bool has_twin = false;
  bool toggles_heartbeat = false;  // bit 7 of the state in its heartbeat toggles, as in node guarding
  // Expedited answers to reads don't give their size (42h) and always have four bytes.
  bool sdo_sizeless = false;
  bool sdo_doubled = false;      // each SDO answer is sent twice
  bool sdo_stray = false;        // before each SDO answer, an answer for another object is sent
  std::int64_t sdo_late_ns = 0;  // additional delay of each SDO answer
  // The slave misses one of this many SYNCs; 0: it misses none.
  std::uint32_t hears_no_sync_in = 0;
  int tpdo_bytes = -1;  // length of the transmit PDOs in bytes; −1: the mapped length
};

}  // namespace proxarm::sim
