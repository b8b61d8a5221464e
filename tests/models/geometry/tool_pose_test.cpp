#include "models/geometry/tool_pose.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "models/base/random.hpp"
#include "models/geometry/pose_algorithm.hpp"

namespace proxarm::models {
namespace {

TEST(ToolPose, DifferenceIsWhatMovesOnePoseToTheOther) {
  Random random(1);
  for (int i = 0; i < 10'000; ++i) {
    Twist start, xi;
    for (auto& x : start) x = random.uniform(-1.0, 1.0);
    for (auto& x : xi) x = random.uniform(-1.0, 1.0);
    // Angles from far below rounding's reach to nearly half a turn.
    xi.tail<3>() *= std::pow(10.0, random.uniform(-12.0, 0.0)) * 1.8;
    const ToolPose b = moved({}, start), a = moved(b, xi);
    // Quaternions are rounded by about 2u each, which turns the vector by as much.
    EXPECT_LE((difference(a, b) - xi).norm(), 4e-15) << xi.transpose();
  }
}

TEST(ToolPose, RotatesAboutTheReferencePoint) {
  Twist xi = Twist::Zero();
  xi[5] = 0.5 * std::numbers::pi;
  const ToolPose q = moved({Vec3(1.0, 2.0, 3.0), Quaternion::Identity()}, xi);
  EXPECT_EQ(q.position, Vec3(1.0, 2.0, 3.0));
  EXPECT_LE((q * Vec3(1.0, 0.0, 0.0) - Vec3(1.0, 3.0, 3.0)).norm(), 1e-15);
}

TEST(ToolPose, HalfATurnIsFoundFromEitherQuaternion) {
  const Vec3 theta = std::numbers::pi * Vec3(0.6, 0.0, 0.8);
  const Quaternion half = rotation_by(theta);
  EXPECT_NEAR(rotation_vector(half).norm(), std::numbers::pi, 1e-15);
  EXPECT_NEAR(rotation_vector(Quaternion(-half.coeffs())).norm(), std::numbers::pi, 1e-15);
}

TEST(ToolPose, TurnsUnitZIntoADirectionAsEigenDoes) {
  Random random(2);
  for (int i = 0; i < 10'000; ++i) {
    const Vec3 to(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
    ASSERT_EQ(rotation_from_z(to).coeffs(), Quaternion::FromTwoVectors(Vec3::UnitZ(), to).coeffs());
  }
  for (const double sign : {1.0, -1.0}) {
    const Vec3 to = sign * 0.3 * Vec3::UnitZ();
    EXPECT_EQ(rotation_from_z(to).coeffs(), Quaternion::FromTwoVectors(Vec3::UnitZ(), to).coeffs());
  }
}

TEST(ToolPose, TurnsUnitZIntoNearlyItsOpposite) {
  Random random(3);
  for (int i = 0; i < 10'000; ++i) {
    const double near = std::pow(10.0, random.uniform(-20.0, -6.0));
    const Vec3 to = Vec3(near * random.uniform(-1.0, 1.0), near * random.uniform(-1.0, 1.0), -1.0).normalized();
    const Quaternion turn = rotation_from_z(to);
    EXPECT_NEAR(turn.norm(), 1.0, 1e-15);
    // c is rounded three times by up to 5.6e-17: w² = (1 + c)/2 by 8.3e-17, w by 9.1e-9, the direction by twice that.
    EXPECT_LE((turn * Vec3::UnitZ() - to).norm(), 1.9e-8) << to.transpose();
  }
}

TEST(FreePose, GoesWhereItIsSent) {
  FreePose g;
  const ToolPose p = moved({}, Twist::Constant(0.3));
  EXPECT_EQ(g.step(Mat6::Identity(), p, {}), p);
  EXPECT_TRUE(g.contacts().empty());
}

}  // namespace
}  // namespace proxarm::models
