#include <cstdio>
#include <limits>

#include "controller/command_line/entry/exit_status.hpp"
#include "controller/extras/commands/commands.hpp"
#include "controller/extras/commissioning/tare_run.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/preparation/start_check.hpp"

namespace proxarm::command_line {
namespace {

constexpr int not_found = 1;

// Prepares a session that takes any reading of the sensor for the zero, unless the reading varies.
controller::PreparedSession prepared_zero(controller::RunOptions options) {
  options.scene = controller::shipped_file("scenes/free.yaml");
  controller::PreparedSession session = controller::prepare(options);
  session.settings.only_tares = true;
  session.settings.zero_drift_N = std::numeric_limits<double>::infinity();
  return session;
}

}  // namespace

int zero_command(const ZeroOptions& options) {
  const bool simulated = options.run.bus.simulated();
  controller::require_interface_for_hardware(options.run);
  if (!simulated) controller::refuse_simulated_options(options.run, options.arm);
  const controller::PreparedSession session = prepared_zero(options.run);
  controller::require_enabling_switch(session, options.run);
  controller::RunOptions of_arm = options.run;
  if (!options.arm.empty()) of_arm.cell = options.arm;
  if (!simulated) controller::require_carried(session, options.run);
  const ZeroOutcome outcome = simulated ? tare_simulated(session, prepared_zero(of_arm), options.run)
                                        : tare_on_interfaces(session, options.run);
  if (!outcome.complete) {
    std::fprintf(stderr, "proxarm zero: %s\n",
                 outcome.fault.fault == controller::Fault::none ? "it was ended before the sensor was tared"
                                                                : controller::describe(outcome.fault, "").c_str());
    return not_found;
  }
  const std::filesystem::path file = options.out.empty() ? controller::zero_path(session.cell) : options.out;
  controller::write_zero(file, outcome.zero);
  const auto& force = outcome.zero.force_S_N;
  std::printf("zero, of a %s arm: (%.4g, %.4g, %.4g) N in S, noise %.2g N: %s\n",
              outcome.zero.real_arm ? "real" : "simulated", force[0], force[1], force[2], outcome.zero.noise_N,
              file.c_str());
  return fine;
}

}  // namespace proxarm::command_line
