#include "controller/command_line/studies/arm_run.hpp"

#include <numbers>

#include "controller/command_line/preparation/data_files.hpp"
#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/trials/cycle_work.hpp"
#include "controller/library/simulated_loop.hpp"

namespace proxarm::command_line {
namespace {

PreparedSession session_of(const studies::ArmSetup& setup) {
  RunOptions options;
  options.mass_kg = setup.mass_kg;
  options.period_s = setup.period_s;
  options.duration_s = setup.settling_s + setup.duration_s;
  if (setup.looks_ahead) options.lookahead = LookaheadChoice{.kind = LookaheadChoice::Kind::automatic};
  options.scene = shipped_file(setup.wall ? "scenes/frictionless_wall.yaml" : "scenes/free.yaml");
  PreparedSession session = prepare(options);
  session.hand.waypoints.clear();
  session.hand.multisine.clear();
  if (setup.wall) {
    // Leans on the wall, which is 0.2 m away, by 30 mm.
    session.hand.waypoints = {{0.0, {0.0, 0.0, 0.0}}, {2.0, {0.23, 0.0, 0.0}}};
  }
  for (std::size_t i = 0; i < setup.sines.size(); ++i) {
    // By turns with and against each other: at first the hand rests where the tool is.
    session.hand.multisine.push_back({.frequency_Hz = setup.sines[i].frequency_Hz,
                                      .amplitude_m = setup.sines[i].amplitude_m,
                                      .phase_rad = i % 2 == 0 ? 0.0 : std::numbers::pi,
                                      .direction = {1.0, 0.0, 0.0}});
  }
  for (description::DriveDescription& drive : session.cell.drives) {
    drive.position_bandwidth_Hz *= setup.drive_factor;
    drive.simulation.position_gain_per_s *= setup.drive_factor;
  }
  return session;
}

}  // namespace

std::vector<studies::ArmSample> run_arm(const studies::ArmSetup& setup) {
  std::vector<studies::ArmSample> samples;
  double rendered_s = 0.0;
  controller::run_quietly(session_of(setup), [&](const controller::CycleRecord& record, const sim::Truth& truth) {
    if (record.phase != controller::Phase::rendering) return;
    rendered_s += setup.period_s;
    if (rendered_s > setup.settling_s) samples.push_back({truth.hand_force_W, truth.X_WT.translation()});
  });
  return samples;
}

studies::CycleCounts count_cycles(const studies::CycleSetup& setup) {
  RunOptions options;
  const auto file = [](const char* name) { return *name == '\0' ? std::filesystem::path() : shipped_file(name); };
  options.cell = file(setup.cell);
  options.scene = file(setup.scene);
  options.hand = file(setup.hand);
  if (setup.looks_ahead) options.lookahead = LookaheadChoice{.kind = LookaheadChoice::Kind::automatic};
  const controller::MotionWork work = count_work(prepare(options));
  return {work.steps, work.joint_limits, work.joint_bounds, work.limited, work.joint_steps, work.guarded};
}

}  // namespace proxarm::command_line
