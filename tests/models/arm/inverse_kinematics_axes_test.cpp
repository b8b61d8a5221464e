// Inverse kinematics of arms that don't have six axes.
#include <gtest/gtest.h>

#include "models/arm/inverse_kinematics.hpp"
#include "tests/allocation_count.hpp"
#include "tests/models/arm/few_axes.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::models {
namespace {

using Status = InverseKinematicsResult::Status;
using tests::Random;
using tests::shipped;

double turn_between(const Pose& A, const Pose& B) {
  return Eigen::AngleAxisd(Mat3(A.linear().transpose() * B.linear())).angle();
}

// A closed way in the tool's space, 0.1 m to each side, at 0.25 m/s and 1 kHz.
Vec3 circle(const InverseKinematics& inverse, int k, int steps) {
  const double turn = 2.0 * M_PI * k / steps;
  const ToolSpace& space = inverse.space();
  Vec3 way = 0.1 * std::sin(turn) * space.axes.col(0);
  if (space.dimensions > 1) way += 0.1 * (1.0 - std::cos(turn)) * space.axes.col(1);
  if (space.dimensions > 2) way += 0.05 * std::sin(2.0 * turn) * space.axes.col(2);
  return way;
}

struct Walk {
  JointVector end;
  double most_turn = 0.0;  // of the tool against the start
};

// Follows the way `rounds` times; each place is to be reached.
Walk walk(const Arm& arm, int rounds) {
  InverseKinematicsConfig config;
  for (double& step : config.max_step_rad) step = 0.003;  // 3 rad/s at 1 kHz
  InverseKinematics inverse(arm, config);
  const Pose start = arm.tool_pose(arm.start_rad());
  constexpr int steps = 2500;
  InverseKinematicsResult result;
  Walk out{arm.start_rad()};
  for (int k = 1; k <= rounds * steps; ++k) {
    Pose X = start;
    X.translation() += circle(inverse, k % steps, steps);
    inverse.solve(out.end, X, result);
    EXPECT_EQ(result.status, Status::converged) << arm.axes() << " axes, step " << k;
    if (result.status != Status::converged) break;
    EXPECT_LE((result.q - out.end).cwiseAbs().maxCoeff(), 0.003 * (1.0 + 1e-9));
    const Pose reached = arm.tool_pose(result.q);
    EXPECT_LE((reached.translation() - X.translation()).norm(), 1e-11);
    out.most_turn = std::max(out.most_turn, turn_between(start, reached));
    out.end = result.q;
  }
  return out;
}

TEST(InverseKinematicsAxes, FollowAWayInTheirSpaceAndComeBackToTheSameAngles) {
  for (const char* name : {"linear", "bench", "gantry", "scara"}) {
    const Arm arm = shipped(name);
    const Walk walked = walk(arm, 2);
    EXPECT_LT((walked.end - arm.start_rad()).cwiseAbs().maxCoeff(), 1e-4) << name;
  }
}

TEST(InverseKinematicsAxes, FourHoldTheToolUprightAndItsTurn) {
  // posture_share of what the axes turn, a hundredth of it against the tool's turn: some 1e-5 rad.
  EXPECT_LT(walk(shipped("scara"), 1).most_turn, 1e-4);
}

TEST(InverseKinematicsAxes, FiveHoldAToolThatHangsDown) {
  const tests::ScratchFolder folder;
  const Walk walked = walk(Arm(tests::five_axes_cell(folder)), 2);
  EXPECT_LT(walked.most_turn, 1e-3);
}

TEST(InverseKinematicsAxes, FiveHoldTheDirectionOfAToolThatPointsAhead) {
  const tests::ScratchFolder folder;
  description::Cell cell = tests::five_axes_cell(folder);
  cell.start_rad = {0.0, 0.3, 0.9, -1.2, 0.0};  // the flange level
  const Arm arm(cell);
  const Walk walked = walk(arm, 1);
  // Its azimuth is that of the arm, which follows the tool by 0.1 m at 0.9 m; its tilt isn't given up.
  EXPECT_GT(walked.most_turn, 0.02);
  EXPECT_LT(walked.most_turn, 0.25);
}

TEST(InverseKinematicsAxes, ThreeInAPlaneHoldTheToolsTurn) {
  const tests::ScratchFolder folder;
  description::Cell cell =
      tests::chain_cell(folder, {{"revolute", "0 0 1"}, {"revolute", "0 0 1"}, {"revolute", "0 0 1"}});
  cell.start_rad = {0.0, 1.4, 0.5};
  EXPECT_LT(walk(Arm(cell), 1).most_turn, 1e-3);  // behind by a hundredth of what a period turns it
}

TEST(InverseKinematicsAxes, TheToolsTurnIsLetGoBeforeItsPlace) {
  // Where the first two are nearly stretched, the third can't turn the tool back any more, but its place is in reach.
  const tests::ScratchFolder folder;
  description::Cell cell =
      tests::chain_cell(folder, {{"revolute", "0 0 1"}, {"revolute", "0 0 1"}, {"revolute", "0 0 1"}});
  cell.start_rad = {-0.1, 0.2, 1.4};
  const Walk walked = walk(Arm(cell), 1);
  EXPECT_GT(walked.most_turn, 1e-3);
}

TEST(InverseKinematicsAxes, SevenHoldTheWholePoseAndTheElbowComesBack) {
  const Arm arm = shipped("seven");
  const Walk once = walk(arm, 1), often = walk(arm, 6);
  EXPECT_LT(once.most_turn, 1e-11);
  // The elbow follows the tool in half a second and is behind it meanwhile; it doesn't wander off round by round, as it
  // does with steps of least norm alone.
  EXPECT_LT((once.end - arm.start_rad()).cwiseAbs().maxCoeff(), 0.03);
  EXPECT_LT((often.end - once.end).cwiseAbs().maxCoeff(), 0.01);
}

TEST(InverseKinematicsAxes, SevenKeepOffTheEndsOfTheirRanges) {
  description::Cell cell = tests::shipped_cell("seven");
  // The elbow has turned nearly as far as axis 3 may; the pose stays, by definition of the null space.
  const Arm arm(cell);
  InverseKinematics inverse(arm);
  InverseKinematicsResult result;
  JointVector q = arm.start_rad();
  const Pose X = arm.tool_pose(q);
  JointVector aside = q;
  aside[2] = 1.2;
  inverse.set_posture(aside);
  for (int k = 0; k < 20000; ++k) {
    inverse.solve(q, X, result);
    ASSERT_EQ(result.status, Status::converged);
    q = result.q;
  }
  const double turned = q[2];
  EXPECT_GT(turned, 0.3) << "the elbow goes towards the posture";
  cell.drives[2].range_rad[1] = turned + 0.01;
  const Arm narrow(cell);
  InverseKinematics careful(narrow);
  careful.set_posture(aside);
  for (int k = 0; k < 20000; ++k) {
    careful.solve(q, X, result);
    ASSERT_EQ(result.status, Status::converged);
    q = result.q;
  }
  EXPECT_LT(q[2], turned - 0.05) << "and keeps off the end of axis 3 where that comes first";
}

TEST(InverseKinematicsAxes, AtRestNothingMoves) {
  for (const char* name : {"linear", "bench", "gantry", "scara", "seven"}) {
    const Arm arm = shipped(name);
    const InverseKinematics inverse(arm);
    InverseKinematicsResult result;
    inverse.solve(arm.start_rad(), arm.tool_pose(arm.start_rad()), result);
    EXPECT_EQ(result.status, Status::converged) << name;
    EXPECT_LT((result.q - arm.start_rad()).cwiseAbs().maxCoeff(), 1e-12) << name;
    inverse.measure_singularity(result);
    EXPECT_GT(result.smallest_singular_value_m_per_rad, 0.05) << name;
  }
}

TEST(InverseKinematicsAxes, OutOfReachTheyLagAndSaySo) {
  for (const char* name : {"bench", "scara", "seven"}) {
    const Arm arm = shipped(name);
    const InverseKinematics inverse(arm);
    InverseKinematicsResult result;
    JointVector q = arm.start_rad();
    Pose X = arm.tool_pose(q);
    X.translation() += 3.0 * Vec3::UnitX();
    bool stopped = false;
    for (int k = 0; k < 1000; ++k) {
      inverse.solve(q, X, result);
      ASSERT_TRUE(result.q.allFinite()) << name;
      ASSERT_LE((result.q - q).cwiseAbs().maxCoeff(), 0.01 * (1.0 + 1e-9)) << name;
      ASSERT_NE(result.status, Status::converged) << name;
      stopped = stopped || (result.q - q).norm() < 1e-6;
      q = result.q;
    }
    EXPECT_TRUE(stopped) << name;
  }
}

TEST(InverseKinematicsAxes, AreFoundFromAnywhere) {
  for (const char* name : {"linear", "bench", "gantry", "scara", "seven"}) {
    const Arm arm = shipped(name);
    const InverseKinematics inverse(arm);
    const Pose X = arm.tool_pose(spread_pose(arm, 5));
    const auto found = inverse.solve_anywhere(X, arm.start_rad());
    ASSERT_TRUE(found) << name;
    EXPECT_LT((arm.tool_pose(*found).translation() - X.translation()).norm(), 1e-9) << name;
  }
}

TEST(InverseKinematicsAxes, TakeNothingFromTheHeap) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  Random random(403);
  for (const char* name : {"linear", "bench", "gantry", "scara", "seven"}) {
    const Arm arm = shipped(name);
    const InverseKinematics inverse(arm);
    InverseKinematicsResult result;
    for (int n = 0; n < 200; ++n) {
      const JointVector q = spread_pose(arm, n);
      Pose X = arm.tool_pose(q);
      X.translation() += random.log_uniform(1e-9, 1.0) * random.direction<3>();
      const std::uint64_t before = tests::allocation_count();
      inverse.solve(q, X, result);
      ASSERT_EQ(tests::allocation_count(), before) << name;
      ASSERT_TRUE(result.q.allFinite()) << name;
    }
  }
}

}  // namespace
}  // namespace proxarm::models
