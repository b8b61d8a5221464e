#include "controller/extras/studies/program/arm_run.hpp"

#include <numbers>
#include <optional>

#include "controller/library/cycle_work.hpp"
#include "controller/library/simulated_loop.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::command_line {
namespace {

controller::PreparedSession session_of(const studies::ArmSetup& setup) {
  controller::RunOptions options;
  options.cell = controller::shipped_file("models/cells/" + setup.cell + ".yaml");
  options.mass_kg = setup.mass_kg;
  options.period_s = setup.period_s;
  options.duration_s = setup.settling_s + setup.duration_s;
  if (setup.looks_ahead)
    options.lookahead = controller::LookaheadChoice{.kind = controller::LookaheadChoice::Kind::automatic};
  const bool turns = setup.turns();
  if (turns) {
    options.inertia_kg_m2 = setup.inertia_kg_m2;
    options.hand = controller::shipped_file("sim/hands/wobble.yaml");
    // With a tool that turns, the wrist swings at 3 Hz and above. That is faster than voluntary hand motion, so
    // passivity would add damping; but here the hand means the motion.
    options.passivity = controller::Passivity::off;
  }
  options.scene = controller::shipped_file(setup.wall ? "scenes/frictionless_wall.yaml" : "scenes/free.yaml");
  controller::PreparedSession session = controller::prepare(options);
  if (setup.torque) {
    session = controller::with_gear_torques(session,
                                            {.object = 0x203100, .bits = 16, .Nm_per_count = 0.05, .delay_s = 0.0005});
  }
  session.hand.waypoints.clear();
  session.hand.multisine.clear();
  if (setup.wall) {
    // The hand leans 30 mm into the wall, which is 0.2 m away.
    session.hand.waypoints = {{0.0, {0.0, 0.0, 0.0}}, {2.0, {0.23, 0.0, 0.0}}};
  }
  const models::Vec3 along = models::Vec3::Unit(setup.axis);
  for (std::size_t i = 0; i < setup.sines.size(); ++i) {
    // Every other sine has the opposite sign, so that the hand starts near the tool.
    session.hand.multisine.push_back({.frequency_Hz = setup.sines[i].frequency_Hz,
                                      .amplitude_m = turns ? 0.0 : setup.sines[i].amplitude,
                                      .amplitude_rad = turns ? setup.sines[i].amplitude : 0.0,
                                      .phase_rad = i % 2 == 0 ? 0.0 : std::numbers::pi,
                                      .direction = {along.x(), along.y(), along.z()}});
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
  std::optional<models::Quaternion> first;
  controller::run_quietly(session_of(setup), [&](const controller::CycleRecord& record, const sim::Truth& truth) {
    if (record.phase != controller::Phase::rendering) return;
    rendered_s += setup.period_s;
    if (!(rendered_s > setup.settling_s)) return;
    const models::Quaternion now(truth.X_WT.linear());
    if (!first) first = now;
    samples.push_back({truth.hand_force_W, truth.X_WT.translation(), truth.hand_torque_W,
                       models::rotation_vector(now * first->conjugate())});
  });
  return samples;
}

studies::CycleCounts count_cycles(const studies::CycleSetup& setup) {
  controller::RunOptions options;
  const auto file = [](const char* name) {
    return *name == '\0' ? std::filesystem::path() : controller::shipped_file(name);
  };
  options.cell = file(setup.cell);
  options.scene = file(setup.scene);
  options.hand = file(setup.hand);
  if (setup.looks_ahead)
    options.lookahead = controller::LookaheadChoice{.kind = controller::LookaheadChoice::Kind::automatic};
  const controller::MotionWork work = controller::count_work(controller::prepare(options));
  return {work.steps, work.programs, work.limited, work.joint_steps, work.guarded};
}

}  // namespace proxarm::command_line
