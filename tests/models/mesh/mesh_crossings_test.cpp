// Faces that cross or lie on one another, and those that only touch.
#include "models/mesh/mesh_crossings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>

#include "models/mesh/mesh_topology.hpp"
#include "models/rigid_features/rigid_features.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/sanitized.hpp"

namespace proxarm::tests {
namespace {

using models::TriangleMesh;
using models::TriangleSoup;
using models::Vec3;

constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

std::size_t pairs_of(const TriangleSoup& soup) { return models::find_crossing_faces(TriangleMesh(soup), kAll).count; }

double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }  // others may use the machine, too

TriangleSoup moved(TriangleSoup soup, const Vec3& by) {
  for (Vec3& x : soup.vertices) x += by;
  return soup;
}

TriangleSoup turned(TriangleSoup soup, Random& random) {
  const double angle = random.uniform(0.0, 3.0);
  const models::Mat3 R = Eigen::AngleAxisd(angle, random.direction()).toRotationMatrix();
  const Vec3 by = random.in_box(0.5);
  for (Vec3& x : soup.vertices) x = R * x + by;
  return soup;
}

TriangleSoup both(TriangleSoup a, const TriangleSoup& b) {
  join(a, b);
  return a;
}

// Four corners, fronts outside.
TriangleSoup tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  TriangleSoup soup{{a, b, c, d}, {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}};
  if ((b - a).cross(c - a).dot(d - a) > 0.0) {
    for (auto& t : soup.triangles) std::swap(t[1], t[2]);
  }
  return soup;
}

// On its tip, which is at the height z, over one of the cube's faces.
TriangleSoup on_its_tip(double z) {
  return tetrahedron({0.03, -0.02, z}, {0.04, -0.02, 0.08}, {0.02, -0.01, 0.08}, {0.02, -0.03, 0.08});
}

const TriangleSoup& cube() {
  static const TriangleSoup soup = block(Vec3::Constant(0.1));
  return soup;
}

// A cube whose top is a fan about a corner at (x, 0): beyond the rim, at x > 0.05, the fan folds back onto itself.
TriangleSoup capped(double x) {
  TriangleSoup soup = cube();
  std::erase_if(soup.triangles, [](const auto& t) { return t[0] >= 4 && t[1] >= 4 && t[2] >= 4; });
  soup.vertices.emplace_back(x, 0.0, 0.05);
  for (const auto& [a, b] : {std::pair{4u, 5u}, {5u, 7u}, {7u, 6u}, {6u, 4u}}) soup.triangles.push_back({a, b, 8u});
  return soup;
}

TEST(MeshCrossings, ToleratesWhatARigidToolDoes) {
  EXPECT_EQ(models::kCrossing_m, models::kGap_m);
  EXPECT_EQ(models::kSheet_m, models::kFront_m);
}

TEST(MeshCrossings, ACapThatIsFoldedLiesOnItself) {
  EXPECT_EQ(pairs_of(capped(0.02)), 0u);
  EXPECT_GT(pairs_of(capped(0.07)), 0u);
  Random random(811);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(pairs_of(turned(capped(0.02), random)), 0u) << i;
    EXPECT_GT(pairs_of(turned(capped(0.07), random)), 0u) << i;
  }
}

TEST(MeshCrossings, ABodyWithoutThicknessLiesOnItself) {
  const TriangleSoup flat = tetrahedron({0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}, {0, 0.1, 0});
  EXPECT_GT(pairs_of(flat), 0u);
  // Two faces back to back, and one that is there twice.
  EXPECT_EQ(pairs_of({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {2, 1, 0}}}), 1u);
  EXPECT_EQ(pairs_of(both(cube(), cube())), 12u);
}

TEST(MeshCrossings, ASheetIsThickerThanTheSidesThatAToolCanTell) {
  Random random(812);
  for (int i = 0; i < 100; ++i) {
    for (const double thick : {1e-6, 1e-8, 1.01 * models::kSheet_m}) {
      EXPECT_EQ(pairs_of(block({0.1, 0.1, thick})), 0u) << thick;
      EXPECT_EQ(pairs_of(turned(block({0.1, 0.1, thick}), random)), 0u) << thick;
    }
    EXPECT_GT(pairs_of(block({0.1, 0.1, 0.99 * models::kSheet_m})), 0u);
    EXPECT_GT(pairs_of(turned(block({0.1, 0.1, 0.99 * models::kSheet_m}), random)), 0u);
  }
}

TEST(MeshCrossings, AFoldThatOpensByMoreThanASheetIsAnEdge) {
  // Two faces with an edge of 0.1 m, and how far the one's corner is over the other one.
  const auto fold = [](double open) {
    return pairs_of({{{0, 0, 0}, {0.1, 0, 0}, {0.03, 0.1, 0}, {0.05, 0.1, open}}, {{0, 1, 2}, {1, 0, 3}}});
  };
  EXPECT_EQ(fold(0.0), 1u);
  EXPECT_EQ(fold(0.9 * models::kSheet_m), 1u);
  EXPECT_EQ(fold(1.1 * models::kSheet_m), 0u);
  // Neighbours in a plane aren't folded.
  EXPECT_EQ(pairs_of({{{0, 0, 0}, {0.1, 0, 0}, {0.03, 0.1, 0}, {0.05, -0.1, 0.0}}, {{0, 1, 2}, {1, 0, 3}}}), 0u);
}

TEST(MeshCrossings, ATetrahedronThroughAFaceCrossesItAndOneThatStandsOnItDoesnt) {
  EXPECT_EQ(pairs_of(both(cube(), on_its_tip(0.03))), 3u);
  EXPECT_EQ(pairs_of(both(cube(), on_its_tip(0.05))), 0u) << "in a point";
  EXPECT_EQ(pairs_of(both(cube(), on_its_tip(0.05 - 0.9 * models::kCrossing_m))), 0u);
  EXPECT_EQ(pairs_of(both(cube(), on_its_tip(0.05 - 1.1 * models::kCrossing_m))), 3u);
  EXPECT_EQ(pairs_of(both(cube(), on_its_tip(0.06))), 0u);
  const models::MeshDefect found = models::crossing_faces(TriangleMesh(both(cube(), on_its_tip(0.03))));
  EXPECT_NEAR(found.first_W.z(), 0.05, 1e-12) << "where they cross";
}

TEST(MeshCrossings, ACubeOnACubeLiesOnItAndOneOnItsEdgeOrCornerTouches) {
  const TriangleSoup small = block(Vec3::Constant(0.04));
  EXPECT_GT(pairs_of(both(cube(), moved(small, {0.0, 0.01, 0.07}))), 0u) << "on top";
  EXPECT_EQ(pairs_of(both(cube(), moved(small, {0.0, 0.01, 0.07 + 1e-8}))), 0u) << "above it";
  EXPECT_GT(pairs_of(both(cube(), moved(small, {0.0, 0.01, 0.03}))), 0u) << "inside, against the top";
  EXPECT_GT(pairs_of(both(cube(), moved(small, {0.04, 0.01, 0.0}))), 0u) << "through a side";
  EXPECT_EQ(pairs_of(both(cube(), moved(small, {0.07, 0.01, 0.07}))), 0u) << "edge to edge";
  EXPECT_EQ(pairs_of(both(cube(), moved(cube(), {0.1, 0.1, 0.1}))), 0u) << "corner to corner";
  EXPECT_EQ(pairs_of(both(cube(), small)), 0u) << "a hollow";
  const TriangleSoup roof = tetrahedron({-0.02, 0.01, 0.05}, {0.03, 0.01, 0.05}, {0, 0, 0.08}, {0, 0.03, 0.08});
  EXPECT_EQ(pairs_of(both(cube(), roof)), 0u) << "on an edge";
}

// Its equator is exactly in the face that it goes through: no face of it is on both sides.
TEST(MeshCrossings, ABodyWhoseEdgesLieInTheFaceThatItPassesCrossesIt) {
  TriangleSoup eight;
  for (int k = 0; k < 3; ++k) {
    eight.vertices.emplace_back(0.02 * Vec3::Unit(k));
    eight.vertices.emplace_back(-0.02 * Vec3::Unit(k));
  }
  for (std::uint32_t k = 0; k < 8; ++k) {
    std::array<std::uint32_t, 3> t{k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2)};
    if (((k & 1) + (k >> 1 & 1) + (k >> 2)) % 2 == 1) std::swap(t[0], t[1]);
    eight.triangles.push_back(t);
  }
  ASSERT_EQ(pairs_of(eight), 0u);
  const TriangleSoup through = both(cube(), moved(eight, {0.005, 0.01, 0.05}));
  EXPECT_GT(pairs_of(through), 0u);
  Random random(813);
  for (int i = 0; i < 100; ++i) EXPECT_GT(pairs_of(turned(through, random)), 0u) << i;
}

TEST(MeshCrossings, TwoWedgesOnOneLineCrossWhereTheirFacesTakeTurns) {
  // By the angles of the faces about the line.
  const auto wedges = [](double a0, double a1, double b0, double b1) {
    const auto at = [](double x, double degrees) {
      const double angle = degrees * std::numbers::pi / 180.0;
      return Vec3(x, 0.1 * std::cos(angle), 0.1 * std::sin(angle));
    };
    return pairs_of(
        {{{0, 0, 0}, {0.1, 0, 0}, at(0.05, a0), at(0.05, a1), {0.03, 0, 0}, {0.07, 0, 0}, at(0.05, b0), at(0.05, b1)},
         {{0, 1, 2}, {1, 0, 3}, {4, 5, 6}, {5, 4, 7}}});
  };
  EXPECT_GT(wedges(0, 60, 30, 90), 0u);
  EXPECT_GT(wedges(0, 180, 30, 270), 0u);
  EXPECT_EQ(wedges(0, 60, 70, 90), 0u);
  EXPECT_EQ(wedges(0, 60, 20, 40), 0u);
  EXPECT_EQ(wedges(20, 40, 0, 60), 0u);
}

// Ears that share a corner: the one's two other corners are on both sides of the other one, before its far side or
// beyond it, or beside it.
TEST(MeshCrossings, EarsThatShareACornerCrossWhereOneGoesThroughTheOther) {
  const auto ears = [](const Vec3& to, double wide) {
    const Vec3 up(0.0, 0.0, wide);
    return pairs_of({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, to + up, to - up}, {{0, 1, 2}, {0, 3, 4}}});
  };
  EXPECT_EQ(ears({0.2, 0.3, 0}, 0.1), 1u);
  EXPECT_EQ(ears({0.8, 0.9, 0}, 0.1), 1u);
  EXPECT_EQ(ears({-0.2, 0.3, 0}, 0.1), 0u);
  EXPECT_EQ(ears({-0.2, -0.3, 0}, 0.1), 0u);
}

TEST(MeshCrossings, RandomStarsDontCrossWhicheverWayTheyAreTurned) {
  Random random(814);
  for (int i = 0; i < scaled(100); ++i) {
    const auto radius = [&random](double, double) { return random.log_uniform(0.01, 0.1); };
    const TriangleSoup star = globe(3 + random.below(8), 3 + random.below(12), radius);
    EXPECT_EQ(pairs_of(star), 0u) << i;
    EXPECT_EQ(pairs_of(turned(star, random)), 0u) << i;
    // Squares in a plane, some of them nearly needles.
    EXPECT_EQ(pairs_of(turned(globe(
                                  12, 4, [](double, double) { return 0.1; }, 0.02),
                              random)),
              0u)
        << i;
  }
}

// In long double: where a triangle's sides pass the other one's plane, along the line that the planes have in common.
struct Stretch {
  long double low = 1.0L, high = 0.0L;
};
using Wide = Eigen::Matrix<long double, 3, 1>;
Stretch stretch(const std::array<Wide, 3>& t, const std::array<long double, 3>& h, const Wide& line) {
  Stretch out{INFINITY, -INFINITY};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3;
    const auto consider = [&](const Wide& x) {
      out = {std::min(out.low, line.dot(x)), std::max(out.high, line.dot(x))};
    };
    if (h[k] == 0.0L) consider(t[k]);
    if (h[k] * h[l] < 0.0L) consider(t[k] + h[k] / (h[k] - h[l]) * (t[l] - t[k]));
  }
  return out;
}

// How long two triangles in general position are inside of each other.
long double common_length(const TriangleMesh& mesh, std::uint32_t f, std::uint32_t g) {
  const std::array<std::uint32_t, 2> both_of{f, g};
  std::array<std::array<Wide, 3>, 2> t;
  std::array<Wide, 2> n;
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t k = 0; k < 3; ++k) t[i][k] = mesh.corner(both_of[i], k).cast<long double>();
    n[i] = (t[i][1] - t[i][0]).cross(t[i][2] - t[i][0]).normalized();
  }
  const Wide line = n[0].cross(n[1]).normalized();
  std::array<Stretch, 2> on;
  for (std::size_t i = 0; i < 2; ++i) {
    std::array<long double, 3> h{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& other = mesh.triangle(both_of[1 - i]);
      const bool shared = std::find(other.begin(), other.end(), mesh.triangle(both_of[i])[k]) != other.end();
      h[k] = shared ? 0.0L : n[1 - i].dot(t[i][k] - t[1 - i][0]);
    }
    on[i] = stretch(t[i], h, line);
  }
  return std::min(on[0].high, on[1].high) - std::max(on[0].low, on[1].low);
}

// Faces between random corners, many of which share one, in general position; pairs that share an edge can't cross.
TEST(MeshCrossings, AreThoseOfAllPairsInLongDouble) {
  Random random(815);
  std::size_t crossing = 0, of_one_corner = 0;
  for (int i = 0; i < scaled(300); ++i) {
    TriangleSoup soup;
    const auto corners = static_cast<std::uint32_t>(8 + random.below(40));
    for (std::uint32_t k = 0; k < corners; ++k) soup.vertices.push_back(random.in_box(0.1));
    for (std::uint32_t k = 0; k < corners; ++k) {
      const auto a = static_cast<std::uint32_t>(random.below(static_cast<int>(corners)));
      const std::uint32_t b = (a + 1 + static_cast<std::uint32_t>(random.below(3))) % corners;
      soup.triangles.push_back({a, b, (b + 1 + static_cast<std::uint32_t>(random.below(2))) % corners});
    }
    std::erase_if(soup.triangles, [](const auto& t) { return t[0] == t[2] || t[0] == t[1]; });
    const TriangleMesh mesh(soup);
    std::size_t expected = 0;
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
      for (std::uint32_t g = f + 1; g < mesh.size(); ++g) {
        int shared = 0;
        for (const auto v : mesh.triangle(f)) {
          for (const auto w : mesh.triangle(g)) shared += v == w ? 1 : 0;
        }
        if (shared == 2) continue;
        const bool cross = shared == 3 || common_length(mesh, f, g) > 1e-15L;
        expected += cross ? 1 : 0;
        of_one_corner += cross && shared == 1 ? 1 : 0;
      }
    }
    ASSERT_EQ(models::find_crossing_faces(mesh, kAll).count, expected) << i;
    crossing += expected;
  }
  EXPECT_GT(crossing, 1000u);
  EXPECT_GT(of_one_corner, 100u);
}

TEST(MeshCrossings, KeepAMeshFromBeingABody) {
  EXPECT_EQ(models::why_no_inside(TriangleMesh(cube())).what, "");
  const models::NoInside found = models::why_no_inside(TriangleMesh(both(cube(), on_its_tip(0.03))));
  EXPECT_NE(found.what.find("cross or lie on one another: 3 pairs, the first at x 0.0"), std::string::npos)
      << found.what;
  EXPECT_NE(found.advice, "");
}

TEST(MeshCrossings, AreCountedUpToAHundredPairs) {
  TriangleSoup soup;
  for (int k = 0; k < 9; ++k) join(soup, cube());  // 36 pairs of cubes, 12 pairs of faces and more for each
  EXPECT_EQ(models::crossing_faces(TriangleMesh(soup)).count, 100u);
  const std::string what = models::why_no_inside(TriangleMesh(soup)).what;
  EXPECT_NE(what.find(": 100 pairs or more, the first at x "), std::string::npos) << what;
}

TEST(MeshCrossings, AreLookedForOnceHoweverOftenTheyAreAskedFor) {
#ifdef PROXARM_SANITIZED
  GTEST_SKIP() << "sanitized";
#endif
  const TriangleMesh mesh(ball(6, 0.1));
  const double begun = processor_s();
  EXPECT_EQ(models::why_no_inside(mesh).what, "");
  const double first_s = processor_s() - begun;
  for (int k = 0; k < 10; ++k) EXPECT_EQ(models::why_no_inside(mesh).what, "");
  EXPECT_LT(processor_s() - begun - first_s, 0.5 * first_s);
}

TEST(MeshCrossings, OfAMeshWithClosedHolesMayComeOfClosingThem) {
  const TriangleMesh mesh(both(cube(), on_its_tip(0.03)));
  EXPECT_EQ(models::why_no_inside(mesh).advice.find("close_holes_m"), std::string::npos);
  EXPECT_EQ(models::why_no_inside(mesh, 2).advice.find("close_holes_m has added 2 triangles over holes"), 0u);
  EXPECT_EQ(models::why_no_inside(TriangleMesh(cube()), 2).what, "");
}

// A double cone, flat and turned, so that all boxes meet.
TriangleSoup fan(std::uint32_t sectors) {
  Random random(816);
  TriangleSoup soup = globe(2, sectors, 0.1);
  for (Vec3& x : soup.vertices) x.z() *= 0.1;
  return turned(soup, random);
}

// Twice the fan has four times the pairs whose boxes meet; looking at each took four times as long.
TEST(MeshCrossings, OfFansAreFoundInATimeThatGrowsAboutAsTheirFacesDo) {
#ifdef PROXARM_SANITIZED
  GTEST_SKIP() << "sanitized";
#endif
  const auto seconds = [](const TriangleSoup& soup) {
    double least_s = 1e9;
    for (int round = 0; round < 3; ++round) {
      const TriangleMesh mesh(soup);
      const double begun = processor_s();
      EXPECT_EQ(models::crossing_faces(mesh).count, 0u);
      least_s = std::min(least_s, processor_s() - begun);
    }
    return least_s;
  };
  EXPECT_LT(seconds(fan(10000)) / seconds(fan(5000)), 3.0);
}

// One needle crosses the fan's other side, or its neighbours; with so many faces that cells are searched.
TEST(MeshCrossings, OfAFanAreThoseThatAllPairsHave) {
  Random random(818);
  std::size_t crossing = 0;
  for (int i = 0; i < scaled(30, 30); ++i) {
    TriangleSoup soup = globe(2, static_cast<std::uint32_t>(300 + random.below(200)), 0.1);
    const double flat = random.log_uniform(1e-3, 1.0);
    for (Vec3& x : soup.vertices) x.z() *= flat;
    for (int k = 0; k < 3; ++k) {
      Vec3& x = soup.vertices[static_cast<std::size_t>(random.below(static_cast<int>(soup.vertices.size())))];
      x += random.log_uniform(1e-5, 0.2) * random.direction();
    }
    if (i % 3 == 0) join(soup, moved(block({0.01, 0.02, 0.03}), random.in_box(0.05)));
    const TriangleMesh mesh(i % 2 == 0 ? soup : turned(soup, random));
    const std::size_t found = models::find_crossing_faces(mesh, kAll).count;
    std::size_t expected = 0;
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
      for (std::uint32_t g = f + 1; g < mesh.size(); ++g) expected += models::crossing_at(mesh, f, g) ? 1 : 0;
    }
    EXPECT_EQ(found, expected) << i;
    crossing += found;
  }
  EXPECT_GT(crossing, 1000u);
}

TEST(MeshCrossings, TimingOfALargeMesh) {
#ifdef PROXARM_SANITIZED
  GTEST_SKIP() << "sanitized";
#endif
  const TriangleMesh mesh(ball(7, 0.1));
  double least_s = 1e9;
  for (int round = 0; round < 3; ++round) {
    const double begun = processor_s();
    EXPECT_EQ(models::find_crossing_faces(mesh, kAll).count, 0u);
    least_s = std::min(least_s, processor_s() - begun);
  }
  std::printf("%zu faces: %.0f ms\n", mesh.size(), 1e3 * least_s);
  EXPECT_LT(least_s, 0.5) << "0.1 s on an idle core";
}

}  // namespace
}  // namespace proxarm::tests
