// Refuses a bus on which two devices would use the same identifier. Two buses of a cell may share an interface and then
// count as one bus.
//
// Frames of two nodes with the same identifier destroy each other. A sensor's poll with a wrong identifier may even be
// a drive's setpoint or an NMT command. Therefore the identifiers are checked before anything is sent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace proxarm::fieldbus {

struct UsedIdentifier {
  std::size_t bus = 0;   // index of the bus in the network
  std::uint32_t id = 0;  // 11 bits
  std::string owner;     // such as "drive of axis_1" or "force sensor"
};

// Throws SetupError that names the identifier and its two owners. `bus_names` holds the name of each bus, by index, for
// the message.
void refuse_shared_identifiers(std::span<const UsedIdentifier> used, std::span<const std::string> bus_names);

}  // namespace proxarm::fieldbus
