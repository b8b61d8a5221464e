// Refuses a bus on which two devices would use one identifier: several of a cell's buses may share one interface.
//
// On CAN, two nodes that send one identifier destroy each other's frames, and a sensor's poll at a wrong place may be a
// drive's setpoint or an NMT command. Checked before anything is sent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace proxarm::fieldbus {

struct UsedIdentifier {
  std::size_t bus = 0;   // index in the network
  std::uint32_t id = 0;  // 11 bits
  std::string owner;     // "drive of axis_1", "force sensor"
};

// Throws SetupError that names both owners and the identifier. `bus_names` by index, for the message.
void refuse_shared_identifiers(std::span<const UsedIdentifier> used, std::span<const std::string> bus_names);

}  // namespace proxarm::fieldbus
