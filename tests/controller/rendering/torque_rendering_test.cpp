// The impedance type over the bus: a light device whose drives take torques, driven back by a hand, and what happens
// when the controller is gone.
#include "controller/rendering/torque_rendering.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/controller/closed_loop/closed_loop_rig.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;
using testing::ClosedLoopRig;
using testing::RigOptions;

RigOptions light_device(double duration_s) {
  RigOptions options;
  options.cell = "models/cells/light.yaml";
  options.duration_s = duration_s;
  options.settings.scheme = Scheme::impedance;
  return options;
}

// K, B, T and the boundary B = 3KT/2 of a light coupling on a heavy mass: x(k) acts from k + 1 to k + 2, on average
// 3T/2 later.
TEST(TorqueRendering, CouplingIsStableAboveThreeHalvesOfKT) {
  ImpedanceConfig config{.stiffness_N_per_m = 1000.0, .damping_Ns_per_m = 1.6, .period_s = 1e-3};
  EXPECT_LT(coupling_spectral_radius(config, 10.0), 1.0);
  config.damping_Ns_per_m = 1.4;
  EXPECT_GT(coupling_spectral_radius(config, 10.0), 1.0);
  config.damping_Ns_per_m = 8.0;
  EXPECT_LT(coupling_spectral_radius(config, 0.1), 1.0);
  EXPECT_GT(coupling_spectral_radius(config, 0.005), 1.0);
}

struct TorqueRenderingTest : ::testing::Test {
  description::Cell cell = description::load_cell(source_file("models/cells/light.yaml"));
  models::Arm arm{cell};
  scenes::Scene scene = scenes::load_scene(source_file("scenes/wall.yaml"));
  scenes::CompiledScene compiled = scenes::compile(scene);
  ImpedanceConfig config{.stiffness_N_per_m = 750.0, .damping_Ns_per_m = 8.0, .period_s = 1e-3};
  std::unique_ptr<TorqueRendering> torques = make_torque_rendering(compiled, arm, cell.drives, cell.limits, config);
  models::JointVector start_rad = arm.start_rad();
  const models::JointVector nothing_Nm = models::JointVector::Zero(3);
  static constexpr double unbounded = std::numeric_limits<double>::infinity();

  // From `from` to `to` at less than the speed that the tool is slowed at.
  const TorqueStep& lead(const models::JointVector& from, const models::JointVector& to) {
    constexpr int steps = 4000;
    for (int i = 1; i < steps; ++i) torques->step(from + (to - from) * (i / static_cast<double>(steps)), unbounded);
    return torques->step(to, unbounded);
  }
  [[nodiscard]] Vec3 force_of(const models::JointVector& q, const models::JointVector& torque_Nm) const {
    models::ToolKinematics tool;
    arm.kinematics(q, tool);
    const models::Mat3 J = tool.J_W.topRows<3>();
    return J.transpose().lu().solve(Vec3(torque_Nm - arm.gravity_torque(q)));
  }
  // The angles at which the tool is beyond the wall at x = 0.9.
  [[nodiscard]] models::JointVector beyond_wall(double depth_m) const {
    models::JointVector q = start_rad;
    models::ToolKinematics tool;
    for (int i = 0; i < 60; ++i) {
      arm.kinematics(q, tool);
      const models::Mat3 J = tool.J_W.topRows<3>();
      q += Vec3(J.lu().solve(Vec3(0.9 + depth_m, 0.0, 0.6) - tool.X_WT.translation())) * 0.5;
    }
    return q;
  }
};

TEST_F(TorqueRenderingTest, CarriesTheDeviceAndNothingElseInFreeSpace) {
  torques->start(start_rad, nothing_Nm);
  const TorqueStep& step = torques->step(start_rad, unbounded);
  EXPECT_LT((step.torque_Nm - arm.gravity_torque(start_rad)).norm(), 1e-12);
  EXPECT_GT(step.torque_Nm.cwiseAbs().maxCoeff(), 1.0) << "it isn't weightless";
  EXPECT_EQ(step.limits.kinds, 0);
}

// 10 mm beyond the wall at x = 0.9, at rest: 750 N/m · 10 mm, out of it.
TEST_F(TorqueRenderingTest, PushesOutOfAWallWithK) {
  const models::JointVector inside = beyond_wall(0.01);
  torques->start(start_rad, nothing_Nm);
  lead(start_rad, inside);
  for (int i = 0; i < 1000; ++i) torques->step(inside, unbounded);
  const TorqueStep& step = torques->step(inside, unbounded);
  // Friction holds what K and B of the way in left along the wall; across it the force is K times the depth.
  EXPECT_NEAR(force_of(inside, step.torque_Nm).x(), -7.5, 1e-3);
  EXPECT_EQ(step.world.contacts, 1);
  EXPECT_NEAR(step.world.q_W.x(), 0.9, 1e-12);
}

// A force that is too large for one joint is weaker, not elsewhere; what holds the device up isn't cut.
TEST_F(TorqueRenderingTest, CutsWhatIsRenderedAndKeepsItsDirection) {
  const models::JointVector inside = beyond_wall(0.03);
  const auto pushed = [&]() -> const TorqueStep& {
    torques->start(start_rad, nothing_Nm);
    lead(start_rad, inside);
    for (int i = 0; i < 1000; ++i) torques->step(inside, unbounded);
    return torques->step(inside, unbounded);
  };
  const Vec3 wanted = force_of(inside, pushed().torque_Nm);
  ASSERT_EQ(pushed().limits.kinds, 0);
  const double most_Nm = 0.7 * pushed().torque_Nm.cwiseAbs().maxCoeff();
  for (description::DriveDescription& drive : cell.drives) drive.max_torque_Nm = most_Nm;
  torques = make_torque_rendering(compiled, arm, cell.drives, cell.limits, config);
  const TorqueStep& step = pushed();
  EXPECT_TRUE(step.limits.has(Limit::joint_torque));
  EXPECT_NEAR(step.torque_Nm.cwiseAbs().maxCoeff(), most_Nm, 1e-9);
  const Vec3 given = force_of(inside, step.torque_Nm);
  EXPECT_LT(given.norm(), wanted.norm());
  EXPECT_NEAR(given.normalized().dot(wanted.normalized()), 1.0, 1e-9);
}

TEST_F(TorqueRenderingTest, PushesBackIntoAJointsRange) {
  models::JointVector at_end = start_rad, beyond = start_rad;
  at_end[0] = cell.drives[0].range_rad[1] - 0.05;
  beyond[0] = cell.drives[0].range_rad[1];
  torques->start(at_end, nothing_Nm);
  const TorqueStep& step = lead(at_end, beyond);
  EXPECT_TRUE(step.limits.has(Limit::joint_range));
  EXPECT_LT(step.torque_Nm[0], -0.9 * cell.drives[0].max_torque_Nm)
      << "all that the drive has, at the end of its range";
}

TEST_F(TorqueRenderingTest, CarriesWhatTheModelOfItsWeightLacked) {
  models::JointVector missing_Nm = nothing_Nm;
  missing_Nm << 0.0, -0.2, 0.1;
  torques->start(start_rad, missing_Nm);
  const TorqueStep& step = torques->step(start_rad, unbounded);
  EXPECT_LT((step.torque_Nm - arm.gravity_torque(start_rad) - missing_Nm).norm(), 1e-12);
}

TEST(TorqueRendering, RendersTheWallOverTheBus) {
  ClosedLoopRig rig(light_device(9.0));
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  double deepest_m = 0.0, strongest_N = 0.0, proxy_m = 0.0;
  bool slid = false;
  for (std::size_t i = 0; i < rig.records.size(); ++i) {
    const CycleRecord& r = rig.records[i];
    if (r.phase != Phase::rendering) continue;
    proxy_m = std::max(proxy_m, r.proxy_W_m[0] - 0.9);
    deepest_m = std::max(deepest_m, rig.truths[i].X_WT.translation().x() - 0.9);
    strongest_N = std::max(strongest_N, -r.contact_force_W_N[0]);
    slid = slid || r.contact == ContactPhase::slip;
  }
  EXPECT_LE(proxy_m, 1e-15);
  EXPECT_TRUE(slid);
  // The hand leans 20 mm into the wall with 500 N/m against 750 N/m: 6 N at 8 mm.
  EXPECT_NEAR(deepest_m, 0.008, 0.0015);
  EXPECT_NEAR(strongest_N, 6.0, 1.2);
  EXPECT_TRUE(rig.cycle->drives_off());
}

// What the hand feels at rest against the wall is K times the depth, up to the joints' friction.
TEST(TorqueRendering, FeelsLikeTheVirtualCoupling) {
  ClosedLoopRig rig(light_device(4.75));  // the hand leans, before it slides
  rig.run();
  const std::size_t last = rig.records.size() - 50;
  std::size_t i = last;
  while (rig.records[i].phase != Phase::rendering) --i;
  const double depth_m = rig.truths[i].X_WT.translation().x() - 0.9;
  ASSERT_GT(depth_m, 0.005);
  // 0.02 Nm of each of two joints over 0.3 m of lever.
  EXPECT_NEAR(rig.truths[i].hand_force_W.x(), 750.0 * depth_m, 0.3);
}

TEST(TorqueRendering, StopsOnADrivesSilenceWithTheOthersOnTheirRamps) {
  RigOptions options = light_device(4.0);
  options.device_faults = {"shoulder:silent@2.0s"};
  ClosedLoopRig rig(options);
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::drive_silent);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_FALSE(rig.far_end.plant().servo(axis).powered()) << axis;
    EXPECT_NE(rig.far_end.drive(axis).state(), sim::DriveState::operation_enabled) << axis;
  }
}

// The controller is killed while the hand moves the device: nothing more comes from it. Each drive's receive PDO timer
// ends the torque within three periods (and a tick of 1 ms) of its last setpoint, its ramp brings it to rest, its brake
// closes.
TEST(TorqueRendering, DrivesComeToRestByThemselvesWhenTheControllerIsGone) {
  ClosedLoopRig rig(light_device(2.0));
  Cycle cycle(rig.prepared_parts(rig.network), rig.options.settings, rig.cell.limits, 64);
  std::int64_t t_ns = rig.network.now_ns();
  const auto run_until = [&](double s) {
    for (; static_cast<double>(t_ns) < 1e9 * s; t_ns += 1'000'000) {
      rig.network.sleep_until(t_ns);
      cycle.run_cycle(t_ns);
      CycleRecord record;
      while (cycle.records().pop(record)) rig.records.push_back(record);
    }
  };
  run_until(2.0);
  ASSERT_EQ(rig.records.back().phase, Phase::rendering);
  const Vec3 at_kill = rig.far_end.truth().X_WT.translation();
  const Vec3 velocity = rig.far_end.truth().velocity_W;
  ASSERT_GT(velocity.norm(), 0.05) << "in mid-motion";
  rig.network.sleep_until(t_ns + 4'000'000);  // last setpoint at t − 0.5 ms, three periods, a tick of the firmware
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // In quick stop by the timer, or in the reaction to the missing SYNC, which ends the same way.
    EXPECT_NE(rig.far_end.drive(axis).state(), sim::DriveState::operation_enabled) << axis;
  }
  rig.network.sleep_until(t_ns + 100'000'000);
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_FALSE(rig.far_end.plant().servo(axis).powered()) << axis;
  // At 60 rad/s² on 0.3 m from 0.1 m/s: a millimetre, and 4 ms at full speed before it begins.
  const double way_m = (rig.far_end.truth().X_WT.translation() - at_kill).norm();
  EXPECT_LT(way_m, 4e-3 * velocity.norm() + 1e-3);
  EXPECT_LT(rig.far_end.truth().velocity_W.norm(), 1e-3);
}

}  // namespace
}  // namespace proxarm::controller
