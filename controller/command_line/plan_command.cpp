#include <algorithm>
#include <cstdio>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/preparation/bus_plan.hpp"
#include "controller/command_line/preparation/cell_buses.hpp"
#include "controller/command_line/preparation/modbus_rates.hpp"
#include "controller/session/identifiers.hpp"

namespace proxarm::command_line {
namespace {

constexpr int not_carried = 1;

}  // namespace

int plan_command(const RunOptions& options) {
  const PreparedSession session = prepare(options);
  const std::vector<std::string> names = bus_names(session.cell);
  const controller::BusIndices indices = indices_of(options.bus.simulated() ? names : options.bus.interfaces(names));
  controller::require_own_identifiers(session.cell, session.sensor, session.settings, indices);
  bool all_fit = true;
  for (const fieldbus::BusPlan& plan : plan_buses(session, indices)) {
    std::printf("%s", fieldbus::plan_text(plan).c_str());
    all_fit = all_fit && plan.fits;
  }
  std::printf("%s", (modbus_plan_text(session) + udp_plan_text(session)).c_str());
  return all_fit ? 0 : not_carried;
}

}  // namespace proxarm::command_line
