#include <cstdio>
#include <limits>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/commissioning/tare_run.hpp"
#include "controller/command_line/entry/exit_status.hpp"
#include "controller/command_line/preparation/bus_plan.hpp"
#include "controller/command_line/preparation/data_files.hpp"
#include "controller/command_line/preparation/start_check.hpp"

namespace proxarm::command_line {
namespace {

constexpr int not_found = 1;

// Prepares a session that takes any reading of the sensor for the zero, unless the reading varies.
PreparedSession prepared(RunOptions options) {
  options.scene = shipped_file("scenes/free.yaml");
  PreparedSession session = prepare(options);
  session.settings.only_tares = true;
  session.settings.zero_drift_N = std::numeric_limits<double>::infinity();
  return session;
}

}  // namespace

int zero_command(const ZeroOptions& options) {
  const bool simulated = options.run.bus.simulated();
  require_interface_for_hardware(options.run);
  if (!simulated) refuse_simulated_options(options.run, options.arm);
  const PreparedSession session = prepared(options.run);
  require_enabling_switch(session, options.run);
  RunOptions of_arm = options.run;
  if (!options.arm.empty()) of_arm.cell = options.arm;
  if (!simulated) require_carried(session, options.run);
  const ZeroOutcome outcome =
      simulated ? tare_simulated(session, prepared(of_arm), options.run) : tare_on_interfaces(session, options.run);
  if (!outcome.complete) {
    std::fprintf(stderr, "proxarm zero: %s\n",
                 outcome.fault.fault == controller::Fault::none ? "it was ended before the sensor was tared"
                                                                : controller::describe(outcome.fault, "").c_str());
    return not_found;
  }
  const std::filesystem::path file = options.out.empty() ? zero_path(session.cell) : options.out;
  write_zero(file, outcome.zero);
  const auto& force = outcome.zero.force_S_N;
  std::printf("zero, of a %s arm: (%.4g, %.4g, %.4g) N in S, noise %.2g N: %s\n",
              outcome.zero.real_arm ? "real" : "simulated", force[0], force[1], force[2], outcome.zero.noise_N,
              file.c_str());
  return fine;
}

}  // namespace proxarm::command_line
