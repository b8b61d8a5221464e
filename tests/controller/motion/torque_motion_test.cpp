#include "controller/motion/torque_motion.hpp"

#include <gtest/gtest.h>

#include "controller/rendering/joint_coupling.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/controller/motion/fake_devices.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using testing::Watched;

struct TorqueMotionTest : ::testing::Test {
  TorqueMotionTest() {
    measured.motor_rad = measured.link_rad = arm.start_rad();
    measured.moved_rad = JointVector::Zero(arm.axes());
    measured.tool_W = arm.tool_pose(arm.start_rad()).translation();
  }
  [[nodiscard]] MotionCycle cycle() {
    record = {};
    motion.begin_cycle();
    return {.measured = measured, .alarm = watched.alarm, .record = record};
  }

  description::Cell cell = description::load_cell(source_file("models/cells/light.yaml"));
  models::Arm arm{cell};
  scenes::CompiledScene scene = scenes::compile(scenes::Scene{});
  ImpedanceConfig config{.stiffness_N_per_m = 750.0, .damping_Ns_per_m = 8.0, .period_s = 1e-3};
  TorqueMotion motion{make_torque_rendering(scene, arm, cell.drives, cell.limits, config),
                      arm,
                      cell.drives,
                      cell.supervision,
                      cell.tool.mass_kg,
                      1e-3};
  Measured measured;
  Watched watched;
  CycleRecord record;
};

TEST_F(TorqueMotionTest, HoldsTheDeviceWhereTheFirstBrakeOpens) {
  motion.wait_for_drives(measured);
  EXPECT_EQ(motion.setpoints().kind, Setpoints::Kind::torques_Nm);
  EXPECT_LT((motion.setpoints().values - arm.gravity_torque(arm.start_rad())).norm(), 1e-9);
  measured.following = 1;
  measured.link_rad[1] += 0.01;
  motion.wait_for_drives(measured);
  const JointVector pulled = motion.setpoints().values - arm.gravity_torque(measured.link_rad);
  EXPECT_GT(pulled.norm(), 0.1) << "back to where it was anchored";
}

TEST_F(TorqueMotionTest, CarriesTheDeviceInFreeSpace) {
  motion.start(measured, Beginning::first);
  ASSERT_TRUE(motion.render(cycle()));
  EXPECT_LT((motion.setpoints().values - arm.gravity_torque(arm.start_rad())).norm(), 1e-9);
  EXPECT_LT((motion.proxy_W() - measured.tool_W).norm(), 1e-12);
}

TEST_F(TorqueMotionTest, StopsADeviceThatRunsAway) {
  motion.start(measured, Beginning::first);
  measured.moved_rad[2] = 1.01e-3 * cell.drives[2].max_speed_rad_per_s;
  EXPECT_FALSE(motion.render(cycle()));
  EXPECT_EQ(watched.times(Fault::target_too_fast), 1u);
  EXPECT_EQ(watched.supervisor.report().where, 2);
}

// 0.2 Nm that the model lacks hold the elbow, and are carried on; 0.5 Nm are a fault, with the joint and the torque.
TEST_F(TorqueMotionTest, JudgesWhatTheHoldTakes) {
  const auto hold_with = [&](double torque_Nm) {
    measured.link_rad = arm.start_rad();
    measured.following = 0;
    motion.wait_for_drives(measured);
    measured.following = 7;
    const double m = 1.0 / arm.mass_matrix(arm.start_rad()).inverse()(2, 2);
    measured.link_rad[2] -= torque_Nm * 1e-6 / (JointCoupling::stiffness_share * m);
    for (int i = 0; i < 400; ++i) motion.stand(measured);
  };
  hold_with(0.2);
  EXPECT_FALSE(motion.missing_weight());
  motion.start(measured, Beginning::first);
  ASSERT_TRUE(motion.render(cycle()));
  EXPECT_NEAR(motion.setpoints().values[2] - arm.gravity_torque(measured.link_rad)[2], 0.2, 0.02);
  hold_with(0.5);
  const std::optional<MissingWeight> missing = motion.missing_weight();
  ASSERT_TRUE(missing);
  EXPECT_EQ(missing->joint, 2);
  EXPECT_NEAR(missing->torque_Nm, 0.5, 0.05);
  EXPECT_NEAR(missing->limit_Nm, 0.36, 1e-12);
}

// A reading of nothing for 2 s: the handle is empty, and the joints are held.
TEST_F(TorqueMotionTest, HoldsTheJointsWhileNobodyHoldsTheHandle) {
  motion.start(measured, Beginning::first);
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(motion.render(cycle()));
  EXPECT_TRUE(record.has(RecordFlag::hands_off));
  measured.link_rad[0] += 1e-3;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(motion.render(cycle()));
  EXPECT_LT(motion.setpoints().values[0], -0.5);
  measured.hand_W.force = {0.0, 1.0, 0.0};  // somebody takes it
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(motion.render(cycle()));
  EXPECT_FALSE(record.has(RecordFlag::hands_off));
  EXPECT_NEAR(motion.setpoints().values[0], 0.0, 1e-3);
}

TEST_F(TorqueMotionTest, NeverHolds) {
  EXPECT_FALSE(motion.can_hold());
  EXPECT_TRUE(motion.stands()) << "its stop is the drives' own";
  EXPECT_FALSE(motion.prepare_freeing({Order::release, 0.0}, measured));
}

}  // namespace
}  // namespace proxarm::controller
