#include "models/arm/held_orientation.hpp"

#include <gtest/gtest.h>

#include "models/arm/tool_space.hpp"
#include "tests/models/arm/few_axes.hpp"

namespace proxarm::models {
namespace {

using tests::shipped;

// A step by G along each direction of the tool's space brings the tool there, and turns it no more than it must.
void expect_goes_there(const Arm& arm, double most_turn) {
  ToolKinematics tool;
  arm.kinematics(arm.start_rad(), tool);
  const SmallColumns3 G = joints_per_m(tool.J_W);
  ASSERT_EQ(G.rows(), arm.axes());
  const Mat3 P = tool_space(arm).projection();
  const Mat3 moves = tool.J_W.topRows<3>() * G;
  // The damping of 1e-3 m/rad takes (λ/σ)²: 1e-4 for the σ of 0.1 m/rad and more that these poses have.
  EXPECT_LT((moves - P).cwiseAbs().maxCoeff(), 2e-3) << moves;
  EXPECT_LT((tool.J_W.bottomRows<3>() * G * P).cwiseAbs().maxCoeff(), most_turn);
}

TEST(HeldOrientation, GoesWhereTheToolCanGoWithAnyNumberOfAxes) {
  expect_goes_there(shipped("linear"), 1e-12);
  expect_goes_there(shipped("gantry"), 1e-12);
  expect_goes_there(shipped("bench"), 10.0);  // two axes: place alone, and the tool turns with them
  expect_goes_there(shipped("default"), 0.01);
  expect_goes_there(shipped("seven"), 0.01);
}

TEST(HeldOrientation, FourAndFiveAxesHoldWhatTheyCan) {
  expect_goes_there(shipped("scara"), 0.1);  // 1/turning_weight of the several radians a metre that its axes turn
  const tests::ScratchFolder folder;
  const Arm five(tests::five_axes_cell(folder));
  expect_goes_there(five, 0.1);  // its tool hangs straight down: the last axis takes back what the first turns
}

TEST(HeldOrientation, StaysBoundedInASingularity) {
  const Arm arm = tests::chain({{"revolute", "0 0 1"}, {"revolute", "0 0 1"}});
  ToolKinematics tool;
  arm.kinematics(JointVector::Zero(2), tool);  // stretched: it can't move along x
  EXPECT_LE(joints_per_m(tool.J_W).cwiseAbs().maxCoeff(), 500.0);
}

}  // namespace
}  // namespace proxarm::models
