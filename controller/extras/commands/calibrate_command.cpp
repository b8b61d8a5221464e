#include "controller/extras/commands/commands.hpp"
#include "controller/preparation/data_files.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

int calibrate_command(const CalibrateOptions& options) {
  controller::require_interface_for_hardware(options.run);
  if (!options.run.bus.simulated() && !options.arm.empty()) {
    throw description::SetupError({.key = "--arm",
                                   .found = "a bus that isn't simulated",
                                   .expected = "--bus sim, where the arm is simulated",
                                   .advice = "on an interface, give it to `proxarm sim`"});
  }
  controller::RunOptions run = options.run;
  run.scene = controller::shipped_file("scenes/free.yaml");
  const controller::PreparedSession session = controller::prepare(run);
  controller::RunOptions of_arm = run;
  if (!options.arm.empty()) of_arm.cell = options.arm;
  return calibrate(session, controller::prepare(of_arm), options);
}

}  // namespace proxarm::command_line
