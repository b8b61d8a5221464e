// What drives are asked for stays within what they have, where the cell says it. The story: an arm at full stretch was
// told to accelerate by what it has beside its base. Its drive lagged, and the tool caught up at 2.4 times its limit.
// tests/command_line/tool_limits_test.py judges the steel.
#include "controller/setpoints/torque_guard.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "controller/setpoints/joint_guard.hpp"
#include "controller/setpoints/tool_guard.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using tests::Random;

constexpr double T = 1e-3;

// With ratings as its simulated drives have them.
description::Cell default_cell() {
  description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  for (description::DriveDescription& drive : cell.drives) drive.max_torque_Nm = drive.simulation.max_torque_Nm;
  return cell;
}

// Both guards, as the motion has them.
struct Guards {
  Guards(const models::Arm& arm, const description::Cell& cell, const JointVector& start_rad)
      : joints(cell.drives, T), tool(arm, cell.drives, cell.limits, T) {
    joints.start(start_rad);
    tool.start(start_rad);
  }
  ActiveLimits step(const JointVector& wanted) {
    joints.step(wanted);
    const ActiveLimits active = tool.step(joints.target_rad(), 1e9, nullptr);
    if (active.kinds == 0) return active;
    joints.settle(tool.target_rad(), tool.speed_rad_per_s());
    joints.follow_from_here();
    return active;
  }

  JointGuard joints;
  ToolGuard tool;
};

// The elbow lies on the upper arm's line; the upper arm somewhere between upright and level.
JointVector stretched(Random& random) {
  JointVector q = JointVector::Zero(6);
  q[0] = random.uniform(-2.0, 2.0);
  q[1] = random.uniform(0.2, 1.5);
  q[2] = -std::atan2(0.1, 0.6) + random.uniform(-0.1, 0.1);
  q[4] = random.uniform(-1.0, 1.0);
  return q;
}

// Jumps and noise at full stretch: each drive is asked for four fifths of its torque at most. Accelerating takes two
// fifths; a braking goes on as it was judged, though the arm's masses change on the way, and the weight comes on top.
TEST(TorqueGuard, AsksNoDriveForMoreThanItHasAtFullStretch) {
  const description::Cell cell = default_cell();
  const models::Arm arm(cell);
  Random random(61);
  double most = 0.0;
  int held_back = 0;
  for (int run = 0; run < tests::scaled(40); ++run) {
    JointVector theta = arm.motor_from_link(stretched(random)), u = JointVector::Zero(6), wanted = theta;
    Guards guards(arm, cell, theta);
    for (int k = 0; k < 500; ++k) {
      if (random.chance(0.02)) {
        for (double& angle : wanted) angle += random.uniform(-0.05, 0.05);
      }
      guards.tool.strain();
      if (guards.step(wanted).has(Limit::joint_torque)) ++held_back;
      const JointVector next = guards.joints.target_rad(), u_now = (next - theta) / T;
      const JointVector q = arm.link_from_motor(theta);
      const JointVector torque_Nm = arm.mass_matrix(q) * (u_now - u) / T + arm.gravity_torque(q);
      for (Eigen::Index i = 0; i < 6; ++i) {
        const double rated_Nm = cell.drives[static_cast<std::size_t>(i)].max_torque_Nm;
        most = std::max(most, std::abs(torque_Nm[i]) / rated_Nm);
      }
      theta = next;
      u = u_now;
    }
  }
  std::printf("most of the drives' torque: %.3f, held back %d times\n", most, held_back);
  EXPECT_GT(held_back, 100);
  EXPECT_LE(most, 0.8);
}

// What torques suffice for passes to the bit, and a cell that doesn't say what drives have is guarded as before.
TEST(TorqueGuard, LeavesOrdinaryMotionsAsTheyAre) {
  const description::Cell rated = default_cell();
  description::Cell unrated = rated;
  for (description::DriveDescription& drive : unrated.drives) drive.max_torque_Nm = 0.0;
  const models::Arm arm(rated);
  const JointVector start_rad = arm.motor_from_link(arm.start_rad());
  Guards with(arm, rated, start_rad), without(arm, unrated, start_rad);
  for (int k = 0; k < 3000; ++k) {
    JointVector wanted = start_rad;
    for (Eigen::Index i = 0; i < 6; ++i) wanted[i] += 0.05 * (1.0 - std::cos(2.0 * M_PI * 0.5 * k * T));
    with.step(wanted);
    without.step(wanted);
    ASSERT_EQ(with.joints.target_rad(), without.joints.target_rad()) << k;
  }
}

// After torque was short, the tool gets faster by 1 m/s² from where it was.
TEST(TorqueGuard, LetsTheToolGetFasterSlowlyAfterwards) {
  const description::Cell cell = default_cell();
  const models::Arm arm(cell);
  TorqueGuard guard(arm, cell.drives, 0.5, T);
  EXPECT_EQ(guard.eased_m_per_s(), 0.5);
  guard.ease_from(0.1);
  for (int k = 0; k < 100; ++k) guard.step();
  EXPECT_NEAR(guard.eased_m_per_s(), 0.2, 1e-9);
  for (int k = 0; k < 400; ++k) guard.step();
  EXPECT_EQ(guard.eased_m_per_s(), 0.5);
}

}  // namespace
}  // namespace proxarm::controller
