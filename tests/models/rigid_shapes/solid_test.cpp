#include "models/rigid_shapes/solid.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "models/base/random.hpp"

namespace proxarm::models {
namespace {

// What a convex hull promises, from the promise alone: all points are behind all faces, each face touches three or
// more, each edge lies on both of its faces, which turn outwards there.
void expect_hull(const Solid& solid, const std::vector<Vec3>& points, double size, bool nearly_flat = false) {
  for (const Solid::Face& face : solid.faces) {
    for (const Vec3& p : points) EXPECT_LE(face.normal.dot(p), face.offset + 1e-9 * size);
    for (const std::uint32_t j : solid.corners(face)) {
      EXPECT_NEAR(face.normal.dot(solid.points[j]), face.offset, 1e-9 * size);
    }
  }
  for (const Solid::Edge& edge : solid.edges) {
    const Vec3 way = solid.points[edge.to] - solid.points[edge.from];
    const double off = std::abs(way.dot(edge.left)) + std::abs(way.dot(edge.right));
    // Needles between sides that are nearly in one plane have edges of nanometres, whose direction says nothing; and
    // corners off a side by 2e-10 of the diagonal are still its.
    EXPECT_LE(off, nearly_flat ? 4e-10 * size : 1e-6 * way.norm());
    EXPECT_TRUE(nearly_flat || edge.left.cross(edge.right).norm() > 0.0);
  }
  EXPECT_EQ(solid.points.size() + solid.faces.size(), solid.edges.size() + 2);  // Euler
}

TEST(Solid, ABoxHasItsCornersEdgesAndFaces) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    Pose X = Pose::Identity();
    X.linear() = Eigen::AngleAxisd(random.uniform(0.0, 3.0), random.direction()).toRotationMatrix();
    X.translation() = random.in_box(0.5);
    const Vec3 size(random.log_uniform(1e-4, 1.0), random.log_uniform(1e-4, 1.0), random.log_uniform(1e-4, 1.0));
    const Solid box = solid_of(BoxTool{size}, X);
    EXPECT_EQ(box.points.size(), 8U);
    EXPECT_EQ(box.edges.size(), 12U);
    EXPECT_EQ(box.faces.size(), 6U);
    expect_hull(box, box.points, size.norm());
  }
}

TEST(Solid, AHullHoldsItsPoints) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    ConvexTool tool;
    const int n = 4 + random.below(200);
    for (int k = 0; k < n; ++k)
      tool.points_m.emplace_back(random.chance(0.5) ? random.in_box(0.01) : 0.012 * random.direction());
    expect_hull(solid_of(tool, Pose::Identity()), tool.points_m, 0.02);
  }
}

// Bodies with flat sides and rows of points on them, one metre wide or so.
std::vector<std::vector<Vec3>> bodies_with_flat_sides() {
  std::vector<std::vector<Vec3>> bodies(4);
  for (int x = 0; x < 5; ++x) {  // a cube whose sides are cut into squares
    for (int y = 0; y < 5; ++y) {
      for (int z = 0; z < 5; ++z) {
        if (x % 4 == 0 || y % 4 == 0 || z % 4 == 0) bodies[0].push_back(0.25 * Vec3(x, y, z));
      }
    }
  }
  for (int k = 0; k < 32; ++k) {  // a prism, and a globe of meridians and parallels
    const double a = 2.0 * std::numbers::pi * k / 32;
    for (const double z : {-0.4, 0.0, 0.4}) bodies[1].emplace_back(0.5 * std::cos(a), 0.5 * std::sin(a), z);
    for (int j = 0; j <= 16; ++j) {
      const double b = std::numbers::pi * j / 16;
      bodies[2].emplace_back(0.5 * std::cos(a) * std::sin(b), 0.5 * std::sin(a) * std::sin(b), 0.5 * std::cos(b));
    }
  }
  for (int k = 0; k < 8; ++k) bodies[3].emplace_back(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.01 : -0.01);
  return bodies;
}

// As a scanner, a file of seven digits or single precision leaves them: sides whose points are off their plane by more
// than rounding, and by less than what tells one side from another.
TEST(Solid, AHullOfPointsThatAreNearlyInOnePlaneHoldsThem) {
  Random random(5);
  for (const std::vector<Vec3>& body : bodies_with_flat_sides()) {
    for (double noise = 1e-17; noise < 1e-4; noise *= 10.0) {
      const Mat3 R = Eigen::AngleAxisd(random.uniform(0.0, 3.0), random.direction()).toRotationMatrix();
      ConvexTool turned, single;
      for (const Vec3& p : body) turned.points_m.push_back(R * p + random.in_box(noise));
      for (const Vec3& p : turned.points_m) single.points_m.push_back(p.cast<float>().cast<double>());
      for (const ConvexTool* tool : {&turned, &single}) {
        SCOPED_TRACE(noise);
        const Solid solid = solid_of(*tool, Pose::Identity());
        expect_hull(solid, tool->points_m, 1.0, true);
        for (int k = 0; k < 100; ++k) {
          const Vec3 n = random.direction();
          double hull = -1.0, all = -1.0;
          for (const Vec3& p : solid.points) hull = std::max(hull, n.dot(p));
          for (const Vec3& p : tool->points_m) all = std::max(all, n.dot(p));
          // Of corners that are merged into a side, 2e-10 of the size at most are left out.
          EXPECT_NEAR(hull, all, 4e-10);
        }
      }
    }
  }
}

TEST(Solid, PointsOfAPlaneSpanNone) {
  ConvexTool tool;
  for (int k = 0; k < 6; ++k) tool.points_m.emplace_back(std::cos(k), std::sin(k), 0.0);
  EXPECT_THROW(solid_of(tool, Pose::Identity()), std::invalid_argument);
  // Turned, they are in it but for rounding.
  for (Vec3& p : tool.points_m) p = Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, 3.0).normalized()) * p;
  EXPECT_THROW(solid_of(tool, Pose::Identity()), std::invalid_argument);
  EXPECT_THROW(solid_of(BoxTool{{1.0, 0.0, 1.0}}, Pose::Identity()), std::invalid_argument);
}

}  // namespace
}  // namespace proxarm::models
