#include "controller/motion/torque_motion.hpp"

#include <gtest/gtest.h>

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
  TorqueMotion motion{make_torque_rendering(scene, arm, cell.drives, cell.limits, config), arm, cell.drives, 1e-3};
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

TEST_F(TorqueMotionTest, NeverHolds) {
  EXPECT_FALSE(motion.can_hold());
  EXPECT_TRUE(motion.stands()) << "its stop is the drives' own";
  EXPECT_FALSE(motion.prepare_freeing({Order::release, 0.0}, measured));
}

}  // namespace
}  // namespace proxarm::controller
