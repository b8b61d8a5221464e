#include "controller/command_line/commands.hpp"
#include "controller/command_line/preparation/data_files.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

int calibrate_command(const CalibrateOptions& options) {
  require_interface_for_hardware(options.run);
  if (!options.run.bus.simulated() && !options.arm.empty()) {
    throw description::SetupError({.key = "--arm",
                                   .found = "a bus that isn't simulated",
                                   .expected = "--bus sim, where the arm is simulated",
                                   .advice = "on an interface, give it to `proxarm sim`"});
  }
  RunOptions run = options.run;
  run.scene = shipped_file("scenes/free.yaml");
  const PreparedSession session = prepare(run);
  RunOptions of_arm = run;
  if (!options.arm.empty()) of_arm.cell = options.arm;
  return calibrate(session, prepare(of_arm), options);
}

}  // namespace proxarm::command_line
