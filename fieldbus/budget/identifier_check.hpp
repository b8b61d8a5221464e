// Refuses a bus on which two devices would use the same identifier. Several of a cell's buses may share an interface.
//
// Such frames destroy each other, and a sensor's poll with a wrong identifier may be a drive's setpoint or an NMT
// command. So this is checked before anything is sent.
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

// Throws SetupError naming both owners and the identifier. `bus_names`: by index, for the message.
void refuse_shared_identifiers(std::span<const UsedIdentifier> used, std::span<const std::string> bus_names);

}  // namespace proxarm::fieldbus
