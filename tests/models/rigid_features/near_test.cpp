#include "models/rigid_features/near.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "models/rigid_shapes/overlap.hpp"
#include "models/rigid_shapes/solid.hpp"

namespace proxarm::models {
namespace {

// The distance of a point from a convex polygon, as that of a segment without a length from the triangles of a fan.
double distance_of(const Vec3& p, const Solid& solid, const Solid::Face& face) {
  const auto corners = solid.corners(face);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    least = std::min(
        least,
        distance_of_segment(p, p, {solid.points[corners[0]], solid.points[corners[k]], solid.points[corners[k + 1]]}));
  }
  return least;
}

TEST(Near, APointThatIsNearAFaceIsNeverLeftOutAndOneThatIsTwiceAsFarSeldomCounts) {
  Random random(1);
  int near = 0, far = 0, counted = 0;
  for (int i = 0; i < 100; ++i) {
    const bool is_box = random.chance(0.3);
    ConvexTool tool;
    for (int k = 30; k > 0; --k) tool.points_m.push_back(random.arrow(0.02, 0.025));
    const Solid solid =
        is_box ? solid_of(BoxTool{Vec3(0.02, 0.03, 0.04)}, Pose::Identity()) : solid_of(tool, Pose::Identity());
    for (const Solid::Face& face : solid.faces) {
      for (int k = 0; k < 30; ++k) {
        const Vec3 p = solid.points[solid.corners(face)[0]] + random.in_box(0.03);
        const double distance = distance_of(p, solid, face), reach = random.log_uniform(1e-4, 0.03);
        const bool counts = distance2_within(solid, face, p, reach) <= reach * reach;
        if (distance <= reach * (1.0 - 1e-12)) {
          ++near;
          EXPECT_TRUE(counts) << distance << " " << reach;
        } else if (distance > 2.0 * reach) {
          ++far;
          counted += counts ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(near, 5'000);
  EXPECT_GT(far, 10'000);
  EXPECT_LT(100 * counted, far);  // (beyond a sharp corner it takes sides for straight on)
}

TEST(Near, APointIsAwayFromAFaceByAtLeastWhatItIsSaidToBe) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    ConvexTool tool;
    for (int k = 20; k > 0; --k) tool.points_m.push_back(random.arrow(0.02, 0.025));
    const Solid solid = solid_of(tool, Pose::Identity());
    for (const Solid::Face& face : solid.faces) {
      for (int k = 0; k < 30; ++k) {
        const Vec3 p = solid.points[solid.corners(face)[0]] + random.in_box(0.03);
        const double distance = distance_of(p, solid, face), said = std::sqrt(distance2_within(solid, face, p, 1.0));
        // (the foot of one that is over it may be known askew to 1e-12)
        EXPECT_LE(said, distance * (1.0 + 1e-9) + 1e-15);
        EXPECT_GE(said, 0.1 * distance);
      }
    }
  }
}

// A slope of 5°, and a coupling that is stiff across it and soft along: pressed by 1 mm it slides by 9, into a wall
// that is 5 mm away. What is further than twice the press isn't looked at, at first.
TEST(Near, AToolThatYieldsFurtherThanItIsPressedMeetsWhatIsFarAway) {
  const double slope = 5.0 * std::numbers::pi / 180.0, away_m = 0.005, half_m = 0.01, thick_m = 1e-4;
  const Vec3 normal(std::cos(slope), std::sin(slope), 0.0);
  Tool tool;
  tool.parts.push_back({BoxTool{Vec3::Constant(2.0 * half_m)}, Pose::Identity(), {}});
  std::vector<RigidObject> objects(2);
  objects[0].shape = FlatSide{normal, -half_m * (normal.x() + normal.y())};
  const Pose X(Eigen::Translation3d(0.0, half_m + away_m + 0.5 * thick_m, 0.0));
  objects[1].shape = solid_of(BoxTool{Vec3(0.1, thick_m, 0.1)}, X);
  objects[1].object = 1;
  RigidWorld g(tool, objects);
  Mat6 K = Mat6::Identity();
  K.diagonal() << 1e6, 1.0, 1e6, 1e6, 1e6, 1e6;
  ToolPose p, q;
  p.position = Vec3(-0.001, 0.0, 0.0);
  const ToolPose r = g.step(K, p, q);
  EXPECT_FALSE(g.unresolved());
  EXPECT_NEAR(r.position.y(), away_m, 1e-7);  // the slope turns it by some 1e-6 rad
  EXPECT_TRUE(std::any_of(g.contacts().begin(), g.contacts().end(), [](const auto& c) { return c.object == 1; }));
  EXPECT_GE(g.clearance_m(r), -1e-12);
}

}  // namespace
}  // namespace proxarm::models
