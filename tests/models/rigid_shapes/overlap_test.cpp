#include "models/rigid_shapes/overlap.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

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

// All planes that two convex bodies can have between them: along the faces of both, and along an edge of each.
double by_all_planes(const Solid& a, const Pose& X, const Solid& b) {
  double best = -1e9;
  for (const Solid::Face& face : a.faces) best = std::max(best, gap_along(X.linear() * face.normal, a, X, b));
  for (const Solid::Face& face : b.faces) best = std::max(best, gap_along(-face.normal, a, X, b));
  for (const Solid::Edge& own : a.edges) {
    for (const Solid::Edge& other : b.edges) {
      const Vec3 n = (X.linear() * (a.points[own.to] - a.points[own.from]).normalized())
                         .cross((b.points[other.to] - b.points[other.from]).normalized());
      if (n.norm() < 1e-6) continue;
      best = std::max({best, gap_along(n.normalized(), a, X, b), gap_along(-n.normalized(), a, X, b)});
    }
  }
  return best;
}

Solid random_hull(Random& random, int points) {
  ConvexTool hull;
  for (int i = 0; i < points; ++i) hull.points_m.push_back(random.arrow(0.02, 0.03));
  return solid_of(hull, Pose::Identity());
}

// A triangle as a solid of two faces; its sides' planes are those of its edges and their neighbours' normals.
Solid solid_of_triangle(const std::array<Vec3, 3>& corners) {
  Solid out;
  out.points = {corners[0], corners[1], corners[2]};
  const Vec3 n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  for (std::uint32_t k = 0; k < 3; ++k) {
    out.edges.push_back({k, (k + 1) % 3, n, -n});
    out.faces.push_back({n.cross(corners[(k + 1) % 3] - corners[k]).normalized() * -1.0, 0.0, 0, 0});
  }
  out.faces.push_back({n, 0.0, 0, 0});
  out.faces.push_back({-n, 0.0, 0, 0});
  return out;
}

// What overlaps is as deep as the best of all planes says, to the rounding of some centimetres. Of what is apart only
// that is told, and no more than there is.
struct Compared {
  int overlapping = 0, apart = 0;

  void expect(double told, double best) {
    if (best > 1e-15) {
      EXPECT_GT(told, 0.0);
      EXPECT_LE(told, best + 1e-15);
      ++apart;
    } else {
      EXPECT_NEAR(told, best, 1e-15);
      ++overlapping;
    }
  }
};

// Edges are asked only for planes on which they can lie: that leaves out none that counts.
TEST(Overlap, OfHullsItIsWhatTheBestOfAllPlanesLeaves) {
  Random random(6);
  Compared seen;
  for (int i = 0; i < 200; ++i) {
    const Solid a = random_hull(random, 4 + random.below(20)), b = random_hull(random, 4 + random.below(20));
    const Pose X = random_pose(random, 0.05);
    seen.expect(separation_of_hulls(a, X, b), by_all_planes(a, X, b));
  }
  EXPECT_GT(seen.overlapping, 50);
  EXPECT_GT(seen.apart, 30);
}

TEST(Overlap, OfAHullAndATriangleItIsWhatTheBestOfAllPlanesLeaves) {
  Random random(7);
  Compared seen;
  for (int i = 0; i < 400; ++i) {
    const Solid a = random_hull(random, 4 + random.below(40));
    const Vec3 middle = random.in_box(0.03);
    const std::array<Vec3, 3> triangle = {middle + random.in_box(0.02), middle + random.in_box(0.02),
                                          middle + random.in_box(0.02)};
    const Pose X = random_pose(random, 0.01);
    const Solid flat = solid_of_triangle(triangle);
    const Separation told = separation_from_triangle(a, X, triangle);
    seen.expect(told.gap, by_all_planes(a, X, flat));
    EXPECT_NEAR(gap_along(told.normal, a, X, flat), told.gap, 1e-15);
  }
  EXPECT_GT(seen.overlapping, 100);
  EXPECT_GT(seen.apart, 50);
}

// As deep as 1e-12 m is enough: what touches, by rounding above or below, isn't looked at any further, and what is
// deeper is told as it is.
TEST(Overlap, WhatIsEnoughEndsTheSearchAndNothingElseDoes) {
  const Solid box = solid_of(BoxTool{Vec3(0.02, 0.02, 0.02)}, Pose::Identity());
  for (const double deep_m : {0.0, 1e-13, 9e-13, 1.1e-12, 1e-9, 1e-4}) {
    Pose X = Pose::Identity();
    X.translation().z() = 0.01 - deep_m;
    const std::array<Vec3, 3> triangle = {Vec3(-0.1, -0.1, 0.0), Vec3(0.1, -0.1, 0.0), Vec3(0.0, 0.1, 0.0)};
    EXPECT_NEAR(separation_from_triangle(box, X, triangle, -1e-12).gap, -deep_m, 1e-17);
    X.translation().z() = 0.02 - deep_m;
    EXPECT_NEAR(separation_of_hulls(box, X, box, -1e-12), -deep_m, 1e-17);
  }
}

// A corner that lies on the opposite side: of one in a thousand the sides' cross product is zero, which is no plane.
TEST(Overlap, ANeedleOfATriangleThatIsInABoxIsNotToldApart) {
  Random random(8);
  const Solid box = solid_of(BoxTool{Vec3(0.02, 0.03, 0.04)}, Pose::Identity());
  int without_a_plane = 0;
  for (int k = 0; k < 100'000; ++k) {
    const Vec3 along = random.log_uniform(0.01, 0.1) * random.direction();
    const Vec3 from = random.in_box(0.005) - random.uniform(0.1, 0.9) * along, to = from + along,
               between = from + random.uniform(0.1, 0.9) * along;
    Pose X = random_pose(random, 0.0);
    const Separation told = separation_from_triangle(box, X, {from, to, between}, -1e-12);
    without_a_plane += (to - from).normalized().cross((between - to).normalized()).isZero(0.0) ? 1 : 0;
    ASSERT_LT(told.gap, -1e-3) << k;  // its middle is 5 mm inside or more
    ASSERT_NEAR(told.normal.norm(), 1.0, 1e-6);
  }
  EXPECT_GT(without_a_plane, 20);
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
