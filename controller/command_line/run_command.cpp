#include "controller/command_line/bus_plan.hpp"
#include "controller/command_line/commands.hpp"
#include "controller/command_line/interface_run.hpp"
#include "controller/command_line/prepared_session.hpp"
#include "controller/command_line/simulated_run.hpp"
#include "models/description/setup_error.hpp"

namespace proxarm::command_line {

int run_command(const RunOptions& options) {
  const PreparedSession session = prepare(options);
  require_stable(session, options);
  if (options.bus.simulated()) {
    require_carried(session);
    return SimulatedRun(session, options).run();
  }
  if (options.pace == Pace::virtual_time) {
    throw description::SetupError({.key = "--pace",
                                   .found = "virtual with --bus on an interface",
                                   .expected = "realtime: the kernel's interfaces live by the machine's clock",
                                   .advice = "leave --pace away, or use --bus sim"});
  }
  return run_on_interfaces(session, options);
}

}  // namespace proxarm::command_line
