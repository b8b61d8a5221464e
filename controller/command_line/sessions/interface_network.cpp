#include "controller/command_line/sessions/interface_network.hpp"

#include <algorithm>
#include <cstdio>

#include "fieldbus/canopen/bus_leader.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

std::vector<fieldbus::BusToLead> buses_to_lead(std::span<const fieldbus::DriveSlot> drives) {
  std::vector<fieldbus::BusToLead> buses;
  for (const fieldbus::DriveSlot& slot : drives) {
    auto found = std::find_if(buses.begin(), buses.end(), [&](const auto& bus) { return bus.bus == slot.bus; });
    if (found == buses.end()) {
      found = buses.insert(found, {.bus = slot.bus, .master_node = slot.drive->settings().master_node});
    }
    found->nodes.push_back(slot.drive->node());
  }
  return buses;
}

}  // namespace

controller::BusIndices indices_in(const fieldbus::SocketCanNetwork& network, std::size_t buses) {
  controller::BusIndices indices;
  for (std::size_t i = 0; i < buses; ++i) indices.push_back(network.bus_of(i));
  return indices;
}

void pass_only(fieldbus::SocketCanNetwork& network, std::size_t bus, const std::vector<std::uint32_t>& ids) {
  std::vector<fieldbus::CanFilter> filters;
  for (const std::uint32_t id : ids) {
    const bool extended = (id & fieldbus::extended_id_flag) != 0;
    const std::uint32_t mask = extended ? 0x1FFFFFFF : 0x7FF;
    filters.push_back({.id = id & mask, .mask = mask, .extended = extended});
  }
  network.set_filters(bus, filters);
}

void listen_before_speaking(fieldbus::SocketCanNetwork& network, std::span<const fieldbus::DriveSlot> drives) {
  const std::vector<fieldbus::BusToLead> buses = buses_to_lead(drives);
  for (const fieldbus::BusToLead& bus : buses) pass_only(network, bus.bus, fieldbus::LeaderWatch(bus).wanted_ids());
  fieldbus::require_nobody_leads(network, buses);
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

void require_word_order(const controller::CycleParts& parts) {
  for (const auto& line : parts.modbus_lines) {
    for (const fieldbus::ModbusDrive* drive : line->drives()) {
      if (drive->word_order_shown() || drive->description().word_order_tried) continue;
      throw description::SetupError(
          {.bus = drive->description().bus,
           .node = drive->description().node,
           .message = "drive of " + drive->description().joint + ": word_order",
           .found = "a first position, " + std::to_string(drive->actual_counts()) +
                    " counts, that reads as well in the other order of its words",
           .expected = "one that shows the order: sent the wrong way round, small setpoints are billions of counts",
           .advice = "move the axis off this place by the drive's own tool; or, once its order was tried, "
                     "`word_order_tried: true` at the drive in the cell"});
    }
  }
}

void bring_up_devices(fieldbus::SocketCanNetwork& network, controller::CycleParts& parts,
                      const std::function<std::vector<std::uint32_t>(std::size_t bus)>& more) {
  listen_before_speaking(network, parts.can_drives);
  for (std::size_t bus = 0; bus < network.bus_count(); ++bus) {
    std::vector<std::uint32_t> ids = controller::wanted_ids(parts, bus);
    const std::vector<std::uint32_t> others = more(bus);
    ids.insert(ids.end(), others.begin(), others.end());
    pass_only(network, bus, ids);
  }
  try {
    controller::bring_up(
        parts, [](fieldbus::ModbusLine& line) { line.start(); },
        [](const std::string& line) { std::fprintf(stderr, "proxarm: %s\n", line.c_str()); });
    require_word_order(parts);
  } catch (const description::SetupError& error) {
    if (error.found().find("no answer") == std::string::npos) throw;
    description::SetupProblem problem = error.problem();
    problem.advice = "is `proxarm sim` running on the same interfaces?" +
                     (problem.advice.empty() ? "" : " Or, with devices of your own: " + problem.advice);
    throw description::SetupError(problem);
  }
}

}  // namespace proxarm::command_line
