#include <algorithm>
#include <cstdio>

#include "controller/command_line/commands.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/modbus_rates.hpp"
#include "controller/session/identifiers.hpp"

namespace proxarm::command_line {
namespace {

constexpr int not_carried = 1;

}  // namespace

int plan_command(const controller::RunOptions& options) {
  const controller::PreparedSession session = controller::prepare(options);
  const std::vector<std::string> names = controller::bus_names(session.cell);
  const controller::BusIndices indices =
      controller::indices_of(options.bus.simulated() ? names : options.bus.interfaces(names));
  controller::require_own_identifiers(session.cell, session.sensor, session.settings, indices);
  bool all_fit = true;
  for (const fieldbus::BusPlan& plan : controller::plan_buses(session, indices)) {
    std::printf("%s", fieldbus::plan_text(plan).c_str());
    all_fit = all_fit && plan.fits;
  }
  std::printf("%s", (controller::modbus_plan_text(session) + controller::udp_plan_text(session)).c_str());
  return all_fit ? 0 : not_carried;
}

}  // namespace proxarm::command_line
