#include "models/rigid_features/near.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "models/base/random.hpp"
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
        const bool counts = comes_near(solid, face, p, reach);
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

}  // namespace
}  // namespace proxarm::models
