// Exact sides and crossings of triangles.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "models/mesh/mesh_predicates.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::tests {
namespace {

using models::Vec3;

// Grid points as doubles, and the determinant in integers: exact on both sides of zero and at it.
TEST(MeshPredicates, OrientationIsThatOfIntegers) {
  __extension__ using Wide = __int128;
  Random random(701);
  int zero = 0;
  for (std::int64_t i = 0; i < scaled(300'000); ++i) {
    const int bits = 1 + random.below(38);
    const auto whole = [&](double half) {
      return static_cast<std::int64_t>(std::llround(random.uniform(-half, half)));
    };
    std::int64_t x[4][3];
    for (auto& point : x) {
      for (auto& c : point) c = whole(std::exp2(bits));
    }
    if (random.chance(0.6)) {
      // In the plane or next to it: a whole-numbered combination, moved by −1, 0 or 1.
      const std::int64_t s = whole(3.0), t = whole(3.0);
      for (int k = 0; k < 3; ++k) x[3][k] = x[0][k] + s * (x[1][k] - x[0][k]) + t * (x[2][k] - x[0][k]);
      x[3][random.below(3)] += random.below(3) - 1;
    }
    Wide d[3][3];
    for (int r = 0; r < 3; ++r) {
      for (int k = 0; k < 3; ++k) d[r][k] = x[r + 1][k] - x[0][k];
    }
    const Wide det = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
                     d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                     d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    Vec3 v[4];
    const double unit = std::exp2(-random.below(60));
    for (int r = 0; r < 4; ++r) {
      for (int k = 0; k < 3; ++k) v[r][k] = unit * static_cast<double>(x[r][k]);
    }
    ASSERT_EQ(models::orientation(v[0], v[1], v[2], v[3]), (det > 0) - (det < 0)) << "bits " << bits;
    zero += det == 0 ? 1 : 0;
  }
  EXPECT_GT(zero, 1000 * scaled(1) / 2);
}

TEST(MeshPredicates, SegmentsTouchAtFacesEdgesAndVerticesAndInThePlane) {
  const Vec3 a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  const auto touches = [&](const Vec3& x, const Vec3& y) {
    const bool once = models::segment_touches_triangle(x, y, a, b, c);
    EXPECT_EQ(once, models::segment_touches_triangle(y, x, c, b, a));
    return once;
  };
  EXPECT_TRUE(touches({0.2, 0.2, 1}, {0.2, 0.2, -1}));
  EXPECT_TRUE(touches({0.2, 0.2, 1}, {0.2, 0.2, 0}));
  EXPECT_FALSE(touches({0.2, 0.2, 1}, {0.2, 0.2, 1e-60}));
  EXPECT_TRUE(touches({0.5, 0.5, 1}, {0.5, 0.5, -1})) << "edge";
  EXPECT_TRUE(touches({1, 0, 1}, {1, 0, -1})) << "vertex";
  EXPECT_FALSE(touches({0.5, std::nextafter(0.5, 1.0), 1}, {0.5, std::nextafter(0.5, 1.0), -1})) << "beside an edge";
  EXPECT_TRUE(touches({-1, 0.2, 0}, {2, 0.2, 0})) << "through, in the plane";
  EXPECT_TRUE(touches({0.2, 0.2, 0}, {0.3, 0.3, 0})) << "within, in the plane";
  EXPECT_TRUE(touches({2, 0, 0}, {1, 0, 0})) << "along an edge up to its end";
  EXPECT_FALSE(touches({2, 0, 0}, {std::nextafter(1.0, 2.0), 0, 0})) << "along an edge, short of it";
  EXPECT_FALSE(touches({2, -1, 0}, {2, 1, 0}));
  EXPECT_FALSE(touches({0, 2, 0}, {2, 0.5, 0}));
}

}  // namespace
}  // namespace proxarm::tests
