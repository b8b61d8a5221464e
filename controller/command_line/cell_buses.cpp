#include "controller/command_line/cell_buses.hpp"

#include <numeric>

namespace proxarm::command_line {

std::vector<std::string> bus_names(const description::Cell& cell) {
  std::vector<std::string> names;
  for (const description::BusDescription& bus : cell.buses) names.push_back(bus.name);
  return names;
}

controller::BusIndices buses_in_order(const description::Cell& cell) {
  controller::BusIndices indices(cell.buses.size());
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  return indices;
}

}  // namespace proxarm::command_line
