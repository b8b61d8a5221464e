#include "models/rigid_shapes/solid.hpp"

#include <gtest/gtest.h>

#include "models/base/random.hpp"

namespace proxarm::models {
namespace {

// What a convex hull promises, from the promise alone: all points are behind all faces, each face touches three or
// more, each edge lies on both of its faces, which turn outwards there.
void expect_hull(const Solid& solid, const std::vector<Vec3>& points, double size) {
  for (const Solid::Face& face : solid.faces) {
    for (const Vec3& p : points) EXPECT_LE(face.normal.dot(p), face.offset + 1e-9 * size);
    for (const std::uint32_t j : solid.corners(face)) {
      EXPECT_NEAR(face.normal.dot(solid.points[j]), face.offset, 1e-9 * size);
    }
  }
  for (const Solid::Edge& edge : solid.edges) {
    const Vec3 along = (solid.points[edge.to] - solid.points[edge.from]).normalized();
    EXPECT_LE(std::abs(along.dot(edge.left)) + std::abs(along.dot(edge.right)), 1e-6);
    EXPECT_GT(edge.left.cross(edge.right).norm(), 0.0);
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

TEST(Solid, PointsOfAPlaneSpanNone) {
  ConvexTool tool;
  for (int k = 0; k < 6; ++k) tool.points_m.emplace_back(std::cos(k), std::sin(k), 0.0);
  EXPECT_THROW(solid_of(tool, Pose::Identity()), std::invalid_argument);
  EXPECT_THROW(solid_of(BoxTool{{1.0, 0.0, 1.0}}, Pose::Identity()), std::invalid_argument);
}

}  // namespace
}  // namespace proxarm::models
