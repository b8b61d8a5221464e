#include "controller/command_line/sessions/interface_network.hpp"

#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

controller::BusIndices indices_in(const fieldbus::SocketCanNetwork& network, std::size_t buses) {
  controller::BusIndices indices;
  for (std::size_t i = 0; i < buses; ++i) indices.push_back(network.bus_of(i));
  return indices;
}

void set_filters(fieldbus::SocketCanNetwork& network, const controller::CycleParts& parts,
                 const std::function<std::vector<std::uint32_t>(std::size_t bus)>& more) {
  for (std::size_t bus = 0; bus < network.bus_count(); ++bus) {
    std::vector<fieldbus::CanFilter> filters;
    std::vector<std::uint32_t> ids = controller::wanted_ids(parts, bus);
    const std::vector<std::uint32_t> others = more(bus);
    ids.insert(ids.end(), others.begin(), others.end());
    for (const std::uint32_t id : ids) {
      const bool extended = (id & fieldbus::extended_id_flag) != 0;
      const std::uint32_t mask = extended ? 0x1FFFFFFF : 0x7FF;
      filters.push_back({.id = id & mask, .mask = mask, .extended = extended});
    }
    network.set_filters(bus, filters);
  }
}

fieldbus::SocketCanNetwork open_network(const std::vector<std::string>& interfaces) {
  try {
    return fieldbus::SocketCanNetwork(interfaces, {.closed = true});
  } catch (const description::SetupError& error) {
    description::SetupProblem problem = error.problem();
    problem.advice +=
        std::string(problem.advice.empty() ? "" : "; ") + "without --bus, `proxarm run` simulates the buses too";
    throw description::SetupError(problem);
  }
}

void bring_up_devices(controller::CycleParts& parts) {
  try {
    controller::bring_up(parts);
  } catch (const description::SetupError& error) {
    if (error.found().find("no answer") == std::string::npos) throw;
    description::SetupProblem problem = error.problem();
    problem.advice = "is `proxarm sim` running on the same interfaces?" +
                     (problem.advice.empty() ? "" : " Or, with devices of your own: " + problem.advice);
    throw description::SetupError(problem);
  }
}

}  // namespace proxarm::command_line
