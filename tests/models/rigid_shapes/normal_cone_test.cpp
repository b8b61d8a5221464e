#include "models/rigid_shapes/normal_cone.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "models/base/random.hpp"
#include "models/geometry/tool_pose.hpp"
#include "models/rigid_features/rigid_object.hpp"
#include "models/rigid_shapes/solid.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"

namespace proxarm::models {
namespace {

const NormalCone::Angle kNoTurn = NormalCone::Angle::of(1e-12);

std::size_t furthest_along(const Vec3& n, std::span<const Vec3> points) {
  return static_cast<std::size_t>(std::max_element(points.begin(), points.end(),
                                                   [&](const Vec3& a, const Vec3& b) { return n.dot(a) < n.dot(b); }) -
                                  points.begin());
}

TEST(NormalCones, TheCornerOfAHullThatIsFurthestHoldsThatDirectionAndFewOthersDo) {
  Random random(1);
  std::size_t held = 0, all = 0;
  for (int i = 0; i < 200; ++i) {
    ConvexTool tool;
    for (int k = 4 + random.below(60); k > 0; --k) tool.points_m.push_back(random.arrow(0.02, 0.025));
    const Solid hull = solid_of(tool, Pose::Identity());
    for (int k = 0; k < 100; ++k) {
      const Vec3 n = random.direction();
      const std::size_t rests = furthest_along(n, hull.points);
      for (std::size_t j = 0; j < hull.points.size(); ++j) {
        const bool holds = hull.cones.of_corners[j].holds(n, kNoTurn);
        EXPECT_TRUE(holds || j != rests);
        held += holds ? 1 : 0;
        ++all;
      }
    }
  }
  EXPECT_LT(5 * held, all);
}

// Dents and all. (At the bottom of a dent a vertex is furthest inwards: there the body is beyond it.)
TEST(NormalCones, TheVertexOfADentedBodyThatIsFurthestOfItsNeighboursHoldsThatDirection) {
  Random random(2);
  const TriangleSoup soup = tests::globe(15, 20, [](double theta, double phi) {
    return 0.02 * (1.0 + 0.3 * std::sin(theta) * std::sin(5.0 * theta) * std::cos(4.0 * phi));
  });
  const TriangleFeatures body(std::make_shared<const TriangleMesh>(soup));
  const TriangleMesh& mesh = body.mesh();
  std::size_t resting = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3 n = random.direction();
    std::vector<char> beaten(mesh.structure().vertices.size(), 0);
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
      for (const std::size_t i : {0U, 1U, 2U}) {
        const std::uint32_t a = mesh.triangle(f)[i], b = mesh.triangle(f)[(i + 1) % 3];
        beaten[n.dot(mesh.vertex(a)) < n.dot(mesh.vertex(b)) ? a : b] = 1;
      }
    }
    for (std::uint32_t v = 0; v < beaten.size(); ++v) {
      if (beaten[v] != 0 || mesh.encloses(mesh.vertex(v) + 1e-6 * n)) continue;
      ++resting;
      EXPECT_TRUE(body.cone(v).holds(body.outwards() * n, kNoTurn)) << v;
    }
  }
  EXPECT_GT(resting, 400U);  // twice as many as a convex body has
}

TEST(NormalCones, ABoxCornersConeEndsAtItsFacesAndATurnWidensItByAsMuch) {
  const Solid box = solid_of(BoxTool{Vec3(0.1, 0.1, 0.1)}, Pose::Identity());
  const NormalCone& cone = box.cones.of_corners[furthest_along(Vec3::Ones(), box.points)];
  EXPECT_NEAR(cone.half.cosine, std::sqrt(1.0 / 3.0), 1e-15);
  const Vec3 across = Vec3(1.0, -1.0, 0.0).normalized(), axis = Vec3::Ones().normalized();
  const double half = std::acos(cone.half.cosine);
  for (const double turn : {1e-9, 0.1, 0.9}) {
    for (const double off : {-1e-10, 1e-10}) {
      const double angle = half + turn + off;
      const Vec3 n = std::cos(angle) * axis + std::sin(angle) * across;
      EXPECT_EQ(cone.holds(n, NormalCone::Angle::of(turn)), off < 0.0) << turn;
    }
  }
  EXPECT_TRUE(cone.holds(-axis, NormalCone::Angle::of(1.0)));
}

// A corner on an edge rests on both faces: a normal between theirs is in its cone, and neither of theirs need be.
TEST(NormalCones, AFaceTakesACornerWhoseConeHoldsAnyNormalBetweenItsOwnAndItsNeighbours) {
  Random random(4);
  std::size_t told = 0;
  for (int i = 0; i < 50; ++i) {
    ConvexTool tool;
    for (int k = 60; k > 0; --k) tool.points_m.push_back(random.arrow(0.02, 0.0201));
    const Solid hull = solid_of(tool, Pose::Identity());
    for (std::size_t f = 0; f < hull.faces.size(); ++f) {
      const NormalCone::Angle& around = hull.cones.around_faces[f];
      if (!around.is_any()) ++told;
      for (const Solid::Edge& edge : hull.edges) {
        if (edge.left != hull.faces[f].normal && edge.right != hull.faces[f].normal) continue;
        const Vec3 n = (edge.left + random.uniform(0.0, 1.0) * (edge.right - edge.left)).normalized();
        const NormalCone needle{n, NormalCone::Angle::of(1e-9)};
        EXPECT_TRUE(needle.holds(hull.faces[f].normal, around));
      }
    }
  }
  EXPECT_GT(told, 1000U);
}

TEST(NormalCones, WhatHasNoFacesAndWhatIsSharpRestsInAnyDirection) {
  Random random(3);
  const Solid rod = solid_of(CapsuleTool{0.1, 0.01}, Pose::Identity());
  ConvexTool needle;
  needle.points_m = {Vec3(0.0, 0.0, 1.0), Vec3(0.01, 0.0, 0.0), Vec3(0.0, 0.01, 0.0), Vec3(-0.01, -0.01, 0.0)};
  const Solid pin = solid_of(needle, Pose::Identity());
  const NormalCone& tip = pin.cones.of_corners[furthest_along(Vec3::UnitZ(), pin.points)];
  for (int k = 0; k < 100; ++k) {
    const Vec3 n = random.direction();
    EXPECT_TRUE(rod.cones.of_corners[0].holds(n, kNoTurn));
    EXPECT_TRUE(tip.holds(n, kNoTurn));
  }
}

// touch_edges_sharp() allows 0.02 rad beyond the faces' normals: 1e-9 rad around that is where it changes.
TEST(NormalCones, AnEdgesConeEndsATouchsSlackBeyondItsFaces) {
  const Solid box = solid_of(BoxTool{Vec3(0.02, 0.03, 0.04)}, Pose::Identity());
  ASSERT_EQ(box.cones.of_edges.size(), 12U);
  for (std::size_t i = 0; i < box.edges.size(); ++i) {
    const Solid::Edge& edge = box.edges[i];
    const Vec3 along = edge.left.cross(edge.right);
    for (const auto& [angle, held] : {std::pair(0.0, true), std::pair(0.0199, true), std::pair(0.02 - 1e-9, true),
                                      std::pair(0.02 + 1e-9, false), std::pair(1.0, false)}) {
      EXPECT_EQ(box.cones.of_edges[i].holds(rotation_by(-angle * along) * edge.left, kNoTurn), held) << angle;
      EXPECT_EQ(box.cones.of_edges[i].holds(rotation_by(angle * along) * edge.right, kNoTurn), held) << angle;
    }
  }
  EXPECT_TRUE(cone_of_edge(Vec3::Zero(), Vec3::Zero()).holds(Vec3::UnitX(), kNoTurn));  // a capsule's
}

TEST(NormalCones, ASumOfAnglesMayBeAddedToOnlyBelowARadian) {
  const auto sum_to = [](double angle) {
    return NormalCone::Angle::between(Vec3::UnitX(), Vec3(std::cos(angle - 0.5), std::sin(angle - 0.5), 0.0)) +
           NormalCone::Angle::of(0.5);
  };
  for (const double angle : {0.6, 0.9, 1.0 - 1e-9}) {
    EXPECT_NEAR(sum_to(angle).narrow().cosine, std::cos(angle), 1e-15) << angle;
  }
  for (const double angle : {1.0 + 1e-9, 1.2, 1.9}) EXPECT_TRUE(sum_to(angle).narrow().is_any()) << angle;
  EXPECT_TRUE(NormalCone::Angle::between(Vec3::UnitX(), -Vec3::UnitX()).is_any());
}

}  // namespace
}  // namespace proxarm::models
