// Joints' limits that aren't made: does no step of that length reach one?
#include "controller/limits/joint_limits.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "controller/limits/limit_sets.hpp"
#include "tests/models/arm/few_axes.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using models::Vec3;
using tests::Random;

constexpr double T = 1e-3;

// G by the definition of held_orientation.hpp, from singular values instead of a Cholesky decomposition.
Eigen::MatrixXd damped_inverse(const models::Jacobian& J_W) {
  Eigen::MatrixXd J = J_W;
  J.bottomRows(3) *= 0.5;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::ArrayXd s = svd.singularValues().array();
  const Eigen::VectorXd inverse = s / (s * s + 1e-6);
  return (svd.matrixV() * inverse.asDiagonal() * svd.matrixU().transpose()).leftCols(3);
}

// A random walk of the links as hands lead them, with jumps now and then. Returns the share of steps of 0.3 mm that
// don't need the limits, after judging each by itself.
double walk(const char* cell_name, std::uint64_t seed, int steps) {
  Random random(seed);
  const description::Cell cell = tests::shipped_cell(cell_name);
  const models::Arm arm(cell);
  JointLimits limits(arm, cell.drives, T);
  JointVector q = arm.start_rad(), speed = JointVector::Zero(arm.axes());
  models::ToolKinematics at;
  int left_out = 0;
  for (int k = 0; k < steps; ++k) {
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      speed[i] = 0.99 * speed[i] + random.uniform(-0.05, 0.05);
      q[i] = std::clamp(q[i] + T * speed[i], arm.lower_rad()[i], arm.upper_rad()[i]);
      if (random.chance(0.0005)) q[i] = random.uniform(arm.lower_rad()[i], arm.upper_rad()[i]);
    }
    JointVector twist(q.size());
    for (double& angle : twist) angle = random.uniform(-0.003, 0.003);
    arm.kinematics(q, at);
    limits.begin(q, twist, at.J_W);
    const double step_m = random.chance(0.5) ? 3e-4 : random.log_uniform(1e-6, 1e-2);
    const double way_m = random.chance(0.5) ? 0.0 : random.uniform(0.0, 0.01);
    if (!limits.out_of_reach(step_m, way_m)) {
      EXPECT_FALSE(limits.planes().empty());
      continue;
    }
    left_out += step_m <= 3e-4 ? 1 : 0;
    const Eigen::MatrixXd G = damped_inverse(at.J_W);
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const description::DriveDescription& drive = cell.drives[static_cast<std::size_t>(i)];
      const double share = T / (T + drive.max_speed_rad_per_s / drive.max_acceleration_rad_per_s2);
      const double up = drive.range_rad[1] - q[i] - std::max(0.0, twist[i]);
      const double down = q[i] - drive.range_rad[0] - std::max(0.0, -twist[i]);
      const double turns = G.row(i).norm() * step_m, before = share * G.row(i).norm() * way_m;
      EXPECT_LE(turns, 0.95 * drive.max_speed_rad_per_s * T) << cell_name << " joint " << i << ", step " << k;
      EXPECT_LE(turns + before, share * std::min(up, down)) << cell_name << " joint " << i << ", step " << k;
      if (testing::Test::HasFailure()) return 0.0;
    }
  }
  return static_cast<double>(left_out) / steps;
}

TEST(JointLimits, NoStepThatDoesWithoutThemReachesOne) {
  // Most of these steps are longer than a hand's, and from poses that no hand leads to.
  EXPECT_GT(walk("default", 41, static_cast<int>(tests::scaled(20'000))), 0.05);
  EXPECT_GT(walk("seven", 42, static_cast<int>(tests::scaled(20'000))), 0.01);
}

// The set of an arm with few axes, or with a rail, isn't bounded.
TEST(JointLimits, AreAlwaysMadeForArmsThatHaveNoBound) {
  EXPECT_EQ(walk("scara", 43, 200), 0.0);
  EXPECT_EQ(walk("rail", 44, 200), 0.0);
}

// Sets that get the joints' limits when a point needs them answer as if they had had them from the start.
TEST(JointLimits, ThatCameLateGiveTheSameNearestPoint) {
  Random random(45);
  const description::Cell cell = tests::shipped_cell("default");
  const models::Arm arm(cell);
  JointLimits limits(arm, cell.drives, T);
  models::ToolKinematics at;
  JointVector q = arm.start_rad();
  int limited = 0;
  for (int k = 0; k < 2000; ++k) {
    for (double& angle : q) angle += random.uniform(-1e-3, 1e-3);
    arm.kinematics(q, at);
    limits.begin(q, JointVector::Zero(arm.axes()), at.J_W);
    StepLimits late;
    late.hard[late.hard_count++] = {Vec3::Zero(), 5e-3, Limit::speed};
    StepLimits early = late;
    late.joints = &limits;
    const Vec3 way = random.log_uniform(1e-5, 4e-3) * random.direction<3>();
    LimitSets<3> lazy, whole;
    lazy.set(late, models::Mat3::Identity());
    lazy.take_joints_for(way.norm());
    const bool inside = lazy.contains(way, 1e-11, true);
    lazy.take_joints();
    for (const LimitPlane<3>& plane : limits.planes()) early.planes[early.plane_count++] = plane;
    whole.set(early, models::Mat3::Identity());
    ASSERT_EQ(inside, whole.contains(way, 1e-11, true)) << k;
    int sweeps = 100, same = 100;
    const auto found = lazy.nearest(way, true, sweeps), expected = whole.nearest(way, true, same);
    ASSERT_EQ(found.x, expected.x) << k;
    limited += found.active.has(Limit::joint_speed) ? 1 : 0;
  }
  EXPECT_GT(limited, 100);
}

}  // namespace
}  // namespace proxarm::controller
