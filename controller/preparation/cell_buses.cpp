#include "controller/preparation/cell_buses.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "models/base/setup_error.hpp"

namespace proxarm::controller {

std::vector<std::string> bus_names(const description::Cell& cell) {
  std::vector<std::string> names;
  for (const description::BusDescription& bus : cell.buses) names.push_back(bus.name);
  return names;
}

BusIndices buses_in_order(const description::Cell& cell) {
  BusIndices indices(cell.buses.size());
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  return indices;
}

BusIndices indices_of(const std::vector<std::string>& interfaces) {
  BusIndices indices;
  std::vector<std::string> seen;
  for (const std::string& interface : interfaces) {
    const auto found = std::find(seen.begin(), seen.end(), interface);
    indices.push_back(static_cast<std::size_t>(found - seen.begin()));
    if (found == seen.end()) seen.push_back(interface);
  }
  return indices;
}

void require_fd(const description::Cell& cell, fieldbus::SocketCanNetwork& network) {
  for (std::size_t i = 0; i < cell.buses.size(); ++i) {
    const description::BusDescription& bus = cell.buses[i];
    if (bus.data_bitrate == 0 || network.carries_fd(network.bus_of(i))) continue;
    const std::string& interface = network.bus(network.bus_of(i)).name();
    throw description::SetupError(
        {.bus = interface,
         .message = "bus " + bus.name + " carries CAN FD, and this interface is set up for classic CAN",
         .advice =
             "ip link set down " + interface + " && ip link set " + interface +
             (fieldbus::is_virtual_can(interface) ? " mtu 72"
                                                  : " type can bitrate " + std::to_string(bus.bitrate) + " dbitrate " +
                                                        std::to_string(bus.data_bitrate) + " fd on") +
             " && ip link set up " + interface});
  }
}

}  // namespace proxarm::controller
