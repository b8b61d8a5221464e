#include <cstdio>

#include "controller/extras/assessment/assessment_report.hpp"
#include "controller/extras/commands/commands.hpp"
#include "controller/extras/trials/trial_run.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/session_checks.hpp"
#include "controller/preparation/start_check.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

constexpr int threshold_exceeded = 1;

// The brakes' delay, and their torque as a share of the drive's peak torque, for a cell that doesn't describe its
// brakes. Both are assumed, not taken from a data sheet: holding brakes of servo motors take about 10 to 100 ms to
// close, and hold about the motor's rated torque, which is a third to a half of the motor's peak torque.
constexpr double assumed_brake_delay_s = 0.1, assumed_brake_share = 0.5;

// Fills in the assumed brakes. Returns the number of drives for which a value was assumed.
int assume_brakes(description::Cell& cell) {
  int assumed = 0;
  for (description::DriveDescription& drive : cell.drives) {
    description::SimulatedDrive& simulated = drive.simulation;
    if (simulated.brake_torque_Nm > 0.0 && simulated.brake_delay_s > 0.0) continue;
    if (simulated.brake_torque_Nm <= 0.0) simulated.brake_torque_Nm = assumed_brake_share * simulated.max_torque_Nm;
    if (simulated.brake_delay_s <= 0.0) simulated.brake_delay_s = assumed_brake_delay_s;
    ++assumed;
  }
  return assumed;
}

assessment::Subject subject_of(const controller::PreparedSession& session, int assumed_brakes) {
  const description::Grip grip = description::tightest_grip(session.hand);
  return {.cell = session.cell.name,
          .hand = session.hand.name,
          .stiffness_N_per_m = grip.stiffness_N_per_m,
          .damping_Ns_per_m = grip.damping_Ns_per_m,
          .hand_mass_kg = session.hand.mass_kg,
          .felt_mass_kg = session.settings.mass_kg,
          .period_s = session.settings.period_s,
          .max_tool_speed_m_per_s = session.cell.limits.max_tool_speed_m_per_s,
          .assumed_brakes = assumed_brakes,
          .assumed_brake_delay_s = assumed_brake_delay_s,
          .assumed_brake_share = assumed_brake_share};
}

}  // namespace

int assess_command(const AssessOptions& options) {
  controller::RunOptions run = options.run;
  run.scene = controller::shipped_file("scenes/free.yaml");
  controller::PreparedSession session = controller::prepare(run);
  if (session.impedance()) {
    throw description::SetupError({.file = session.cell.file.string(),
                                   .key = "assess",
                                   .found = "a cell of the impedance type",
                                   .expected = "one whose drives take positions"});
  }
  controller::require_usable_start(session);
  controller::require_stable(session, run);
  controller::require_carried(session, run);
  const assessment::Thresholds thresholds =
      assessment::load_thresholds(options.thresholds.empty() ? controller::shipped_file("models/thresholds/hands.yaml")
                                                             : controller::user_file(options.thresholds));
  const int assumed = assume_brakes(session.cell);
  const models::Arm arm(session.cell);
  const auto poses = assessment::poses_about_start(session.cell, arm, options.poses);
  const assessment::Assessment found =
      assessment::assess(poses, assessment::directions_of(models::tool_space(arm)), thresholds,
                         [&](const assessment::Trial& trial) { return run_trial(session, trial); });
  const assessment::Subject subject = subject_of(session, assumed);
  const std::string text =
      options.run.json ? assessment::json(subject, found, thresholds) : assessment::text(subject, found, thresholds);
  std::fputs(text.c_str(), stdout);
  return assessment::exceeded(found, thresholds).empty() ? 0 : threshold_exceeded;
}

}  // namespace proxarm::command_line
