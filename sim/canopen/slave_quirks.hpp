// What a simulated CANopen slave does otherwise than CiA 301 says, or than a good line would let it.
#pragma once

#include <cstdint>

namespace proxarm::sim {

struct SlaveQuirks {
  bool mutes_heartbeat = false;
  bool mutes_sdo = false;
  bool has_twin = false;           // another node has its number: each transmit PDO comes twice, with two positions
  bool toggles_heartbeat = false;  // bit 7 of its state changes each time, as in answers of node guarding
  bool sdo_sizeless = false;       // expedited read answers without their size (42h): four bytes, whatever the object
  bool sdo_doubled = false;        // each SDO answer comes twice
  bool sdo_stray = false;          // before each SDO answer one for an object that nobody asked for
  std::int64_t sdo_late_ns = 0;    // by which each SDO answer comes later
  std::uint32_t hears_no_sync_in = 0;  // of so many SYNCs it misses one; 0: none
  int tpdo_bytes = -1;                 // length of its transmit PDOs, whatever is mapped; −1: what is mapped
};

}  // namespace proxarm::sim
