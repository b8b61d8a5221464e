#include "controller/command_line/sessions/zero_run.hpp"

#include <cmath>
#include <cstdio>

#include "controller/live/hardware_consent.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/proof_file.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

using controller::Cycle;

controller::ZeroFile zero_of(const controller::PreparedSession& session, const Cycle& cycle, bool real_arm) {
  const controller::Measurement& measurement = cycle.measurement();
  const models::Wrench& bias_S = measurement.compensation().bias_S();
  const models::JointVector& motor_rad = measurement.now().motor_rad;
  return {.cell_sha256 = controller::cell_sha256(session),
          .real_arm = real_arm,
          .date = controller::today(),
          .force_S_N = {bias_S.force.x(), bias_S.force.y(), bias_S.force.z()},
          .torque_S_Nm = {bias_S.torque.x(), bias_S.torque.y(), bias_S.torque.z()},
          .noise_N = measurement.now().bias.noise_N,
          .spread_N = measurement.tare_spread_N(),
          .motor_rad = {motor_rad.data(), motor_rad.data() + motor_rad.size()}};
}

void know_zero(controller::PreparedSession& session, const controller::RunOptions& options) {
  const bool real = !options.bus.simulated() &&
                    controller::is_real(session, options.bus.interfaces(controller::bus_names(session.cell)));
  const std::optional<controller::ZeroFile> kept = controller::kept_zero(session, real);
  if (kept) {
    session.settings.zero_S_N = kept->force_S_N;
  } else if (real) {
    session.settings.zero_S_N = {};
  }
}

void keep_zero(const controller::PreparedSession& session, const controller::RunOptions& options,
               const std::vector<std::string>& interfaces, const Cycle& cycle) {
  const bool accepted = std::isfinite(options.settings.zero_drift_N);
  if (accepted || cycle.supervisor().faulted() || cycle.rendered_cycles() == 0 ||
      !controller::is_real(session, interfaces))
    return;
  try {
    controller::write_zero(controller::zero_path(session.cell), zero_of(session, cycle, true));
  } catch (const description::SetupError& error) {
    std::fprintf(stderr, "proxarm: warning: %s\n", error.what());
  }
}

}  // namespace proxarm::command_line
