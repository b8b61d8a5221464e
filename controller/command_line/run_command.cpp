#include "controller/command_line/commands.hpp"
#include "controller/command_line/live/live_parameters.hpp"
#include "controller/command_line/preparation/bus_plan.hpp"
#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/preparation/start_check.hpp"
#include "controller/command_line/sessions/interface_run.hpp"
#include "controller/command_line/sessions/simulated_run.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

namespace {

void refuse_for_interfaces(const RunOptions& options) {
  if (!options.faults.empty()) {
    throw description::SetupError({.key = "--fault",
                                   .found = "a bus that isn't simulated",
                                   .expected = "--bus sim, where devices can be made to fail",
                                   .advice = "on an interface, give it to `proxarm sim`"});
  }
  if (!options.enabling.empty()) {
    throw description::SetupError({.key = "--enabling",
                                   .found = "a bus that isn't simulated",
                                   .expected = "--bus sim, where the enabling switch is simulated",
                                   .advice = "on an interface, give it to `proxarm sim`"});
  }
  if (options.pace == Pace::virtual_time) {
    throw description::SetupError({.key = "--pace",
                                   .found = "virtual with --bus on an interface",
                                   .expected = "realtime: the kernel's interfaces live by the machine's clock",
                                   .advice = "leave --pace away, or use --bus sim"});
  }
}

}  // namespace

int run_command(const RunOptions& options) {
  if (!options.bus.simulated()) refuse_for_interfaces(options);
  const PreparedSession session = prepare(options);
  require_usable_start(session);
  require_enabling_switch(session, options);
  require_stable(session, options);
  if (options.bus.simulated()) {
    require_carried(session);
  }
  require_changes(session, options);
  BlackBoxKeeper keeper(session, options);
  if (options.bus.simulated()) return SimulatedRun(session, options, keeper).run();
  return run_on_interfaces(session, options, keeper);
}

}  // namespace proxarm::command_line
