// The depth of a mesh's dents against bodies whose dents are known.
#include "scenes/format/dent.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <utility>

namespace proxarm::scenes {
namespace {

using models::TriangleMesh;
using models::TriangleSoup;
using models::Vec3;

double deepest_m(TriangleSoup soup) {
  const models::ConvexTool points{.points_m = soup.vertices};
  return deepest_dent_m(TriangleMesh(std::move(soup)), models::solid_of(points, models::Pose::Identity()));
}

void add_square(TriangleSoup& soup, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  soup.triangles.push_back({a, b, c});
  soup.triangles.push_back({a, c, d});
}

// A cube of edge 2 about the origin, whose top has a point at (0, 0, `top`) in its middle.
TriangleSoup cube(double top) {
  TriangleSoup soup;
  for (const double z : {-1.0, 1.0}) {
    for (const auto& [x, y] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
      soup.vertices.emplace_back(x, y, z);
    }
  }
  soup.vertices.emplace_back(0.0, 0.0, top);
  add_square(soup, 3, 2, 1, 0);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t j = (i + 1) % 4;
    add_square(soup, i, j, 4 + j, 4 + i);
    soup.triangles.push_back({4 + i, 4 + j, 8});
  }
  return soup;
}

TEST(Dent, IsAsDeepAsItsDeepestPointIsBelowTheHull) {
  EXPECT_NEAR(deepest_m(cube(0.5)), 0.5, 1e-15);
  EXPECT_NEAR(deepest_m(cube(0.01)), 0.99, 1e-15);  // a corner over a slanting side of it would be 0.7 above that
}

TEST(Dent, OfWhatIsConvexIsNone) {
  EXPECT_NEAR(deepest_m(cube(1.0)), 0.0, 1e-15);
  EXPECT_NEAR(deepest_m(cube(1.5)), 0.0, 1e-15);
}

// All corners of an L are on its hull: it is deepest in the middle of its inner edge, which is 1/√2 from the hull's
// slanting face and as far as that or more from its ends.
TEST(Dent, IsFoundBetweenCorners) {
  TriangleSoup soup;
  for (const double z : {0.0, 2.0}) {
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {2.0, 0.0}, {2.0, 1.0}, {1.0, 1.0}, {1.0, 2.0}, {0.0, 2.0}}) {
      soup.vertices.emplace_back(x, y, z);
    }
  }
  for (std::uint32_t i = 0; i < 6; ++i) add_square(soup, i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i);
  add_square(soup, 3, 2, 1, 0);
  add_square(soup, 3, 0, 5, 4);
  add_square(soup, 6, 7, 8, 9);
  add_square(soup, 6, 9, 10, 11);
  const double found = deepest_m(std::move(soup));
  EXPECT_LE(found, std::sqrt(0.5) + 1e-15);
  EXPECT_GE(found, std::sqrt(0.5) / 1.01 - 1e-9);
}

}  // namespace
}  // namespace proxarm::scenes
