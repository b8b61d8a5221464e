#include "controller/command_line/cell_buses.hpp"

#include <numeric>

namespace proxarm::command_line {

std::vector<std::string> bus_names(const description::Cell& cell) {
  std::vector<std::string> names;
  for (const description::BusDescription& bus : cell.buses) names.push_back(bus.name);
  return names;
}

std::vector<fieldbus::SimulatedBusConfig> simulated_buses(const description::Cell& cell) {
  std::vector<fieldbus::SimulatedBusConfig> buses;
  for (const description::BusDescription& bus : cell.buses) {
    fieldbus::SimulatedBusConfig config;
    config.name = bus.name;
    config.bitrate = bus.bitrate;
    config.data_bitrate = bus.data_bitrate;
    buses.push_back(config);
  }
  return buses;
}

controller::BusIndices buses_in_order(const description::Cell& cell) {
  controller::BusIndices indices(cell.buses.size());
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  return indices;
}

}  // namespace proxarm::command_line
