#include "models/rigid_shapes/overlap.hpp"

#include <gtest/gtest.h>

#include "models/base/random.hpp"

namespace proxarm::models {
namespace {

Pose random_pose(Random& random, double size) {
  Pose X = Pose::Identity();
  X.linear() = Eigen::AngleAxisd(random.uniform(0.0, 3.0), random.direction()).toRotationMatrix();
  X.translation() = random.in_box(size);
  return X;
}

double gap_along(const Vec3& n, const Solid& a, const Pose& X, const Solid& b) {
  double furthest = -1e9, nearest = 1e9;
  for (const Vec3& p : a.points) furthest = std::max(furthest, n.dot(X * p));
  for (const Vec3& p : b.points) nearest = std::min(nearest, n.dot(p));
  return nearest - furthest;
}

TEST(Overlap, BoxesThatOverlapByAKnownDepthAreThatDeepInEachOther) {
  const Solid box = solid_of(BoxTool{Vec3(0.02, 0.04, 0.06)}, Pose::Identity());
  for (const double deep_m : {1e-9, 1e-6, 1e-3, 0.005}) {
    Pose X = Pose::Identity();
    X.translation() = Vec3(0.02 - deep_m, 0.003, -0.01);
    EXPECT_NEAR(separation_of_hulls(box, X, box), -deep_m, 1e-16);
  }
}

// Two tents whose ridges cross: only a plane along both ridges tells them apart.
TEST(Overlap, EdgesThatCrossHaveAPlaneOfTheirOwn) {
  const Solid box = solid_of(BoxTool{Vec3(0.1, 0.1, 0.1)}, Pose::Identity());
  const double half_diagonal = 0.05 * std::sqrt(2.0);
  Pose lower = Pose::Identity(), upper = Pose::Identity();
  lower.linear() = Eigen::AngleAxisd(M_PI / 4.0, Vec3::UnitX()).toRotationMatrix();
  upper.linear() = Eigen::AngleAxisd(M_PI / 4.0, Vec3::UnitY()).toRotationMatrix();
  for (const double gap_m : {-1e-4, 1e-4}) {
    upper.translation() = Vec3(0.0, 0.0, 2.0 * half_diagonal + gap_m);
    EXPECT_NEAR(separation_of_hulls(box, lower.inverse() * upper, box), gap_m, 1e-15);
  }
}

// The depth is what the best of all directions leaves: none of many is better, and some come close.
TEST(Overlap, NoDirectionLeadsOutOnAShorterWay) {
  Random random(5);
  int overlapping = 0;
  for (int i = 0; i < 60; ++i) {
    const auto size = [&] {
      return Vec3(random.uniform(0.01, 0.1), random.uniform(0.01, 0.1), random.uniform(0.01, 0.1));
    };
    const Solid a = solid_of(BoxTool{size()}, Pose::Identity()),
                b = solid_of(BoxTool{size()}, random_pose(random, 0.02));
    const Pose X = random_pose(random, 0.04);
    const double told = separation_of_hulls(a, X, b);
    if (told >= 0.0) continue;
    ++overlapping;
    double best = -1e9;
    for (int k = 0; k < 20'000; ++k) best = std::max(best, gap_along(random.direction(), a, X, b));
    EXPECT_LE(best, told + 1e-15);
    EXPECT_NEAR(best, told, 0.2 * std::abs(told) + 1e-3);  // of 20,000 directions one is within some 0.02 rad
  }
  EXPECT_GT(overlapping, 20);
}

TEST(Overlap, APointInsideOfABoxIsAsDeepAsItsNearestFace) {
  const Solid point = solid_of(SphereTool{0.01}, Pose::Identity());
  const Solid box = solid_of(BoxTool{Vec3(0.1, 0.2, 0.3)}, Pose::Identity());
  Pose X = Pose::Identity();
  X.translation() = Vec3(0.02, 0.09, 0.1);
  EXPECT_NEAR(separation_of_hulls(point, X, box), -0.01, 1e-16);
}

}  // namespace
}  // namespace proxarm::models
