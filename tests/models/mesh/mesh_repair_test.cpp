// What programs leave in mesh files: corners that differ by rounding, and faces that are there more than once.
#include "models/mesh/mesh_repair.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "models/base/random.hpp"
#include "models/mesh/mesh_surface.hpp"
#include "models/mesh/mesh_topology.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"

namespace proxarm::tests {
namespace {

using models::Random;
using models::TriangleMesh;
using models::TriangleSoup;
using models::Vec3;

// Each triangle with corners of its own, each coordinate off by up to `by_m`.
TriangleSoup jittered(const TriangleSoup& soup, double by_m, Random& random) {
  TriangleSoup out;
  for (const auto& t : soup.triangles) {
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    for (const std::uint32_t v : t) out.vertices.push_back(soup.vertices[v] + random.in_box<3>(by_m));
    out.triangles.push_back({first, first + 1, first + 2});
  }
  return out;
}

double largest_coordinate(const TriangleSoup& soup) {
  double largest = 0.0;
  for (const Vec3& x : soup.vertices) largest = std::max(largest, x.lpNorm<Eigen::Infinity>());
  return largest;
}

// Ways from outside to inside over random points of the edges that a mesh should have, on which nothing holds.
int falls_through(const TriangleMesh& mesh, const TriangleSoup& ideal, double jitter_m, Random& random) {
  int falls = 0;
  for (const auto& t : ideal.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &a = ideal.vertices[t[k]], &b = ideal.vertices[t[(k + 1) % 3]];
      const Vec3 on = a + random.uniform(0.01, 0.99) * (b - a) + random.in_box<3>(0.5 * jitter_m);
      if (!mesh.first_hit(1.1 * on, 0.9 * on).any()) ++falls;
    }
  }
  return falls;
}

// Of a size of 0.2 m: the corners of cubes and balls differ by 1e-9 to 1e-6 of it. A point fell into such meshes
// through cracks of 0.1 µm, 57 mm deep.
TEST(MeshRepair, MakesCubesAndBallsOfTrianglesThatDifferByRoundingClosedAndHolding) {
  constexpr double size_m = 0.2;
  int fell_before = 0;
  for (const double share : {1e-9, 1e-8, 1e-7, 1e-6}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      Random random(seed);
      for (const TriangleSoup& ideal : {block(Vec3::Constant(size_m)), ball(2, 0.5 * size_m), globe(9, 14, 0.1)}) {
        SCOPED_TRACE("share " + std::to_string(share) + ", seed " + std::to_string(seed));
        const TriangleMesh torn(jittered(ideal, share * size_m, random));
        fell_before += falls_through(torn, ideal, share * size_m, random);
        TriangleSoup soup{torn.structure().vertices, torn.structure().triangles};
        const models::WeldedCorners welded =
            models::weld_borders(soup, models::default_weld(largest_coordinate(soup), 0.0));
        EXPECT_EQ(welded.corners, 3 * ideal.triangles.size() - ideal.vertices.size());
        EXPECT_EQ(welded.collapsed, 0u);
        EXPECT_LE(welded.apart_m, 2.0 * std::numbers::sqrt3 * share * size_m);
        const TriangleMesh mesh(std::move(soup));
        EXPECT_TRUE(mesh.closed());
        EXPECT_EQ(mesh.size(), ideal.triangles.size());
        const models::MeshTopology found = models::topology_of(mesh);
        EXPECT_EQ(found.parts, 1u);
        EXPECT_EQ(found.non_manifold.count, 0u);
        EXPECT_EQ(falls_through(mesh, ideal, share * size_m, random), 0);
      }
    }
  }
  EXPECT_GT(fell_before, 100) << "else the jitter tears nothing";
}

TEST(MeshRepair, LeavesAClosedMeshAsItIsWhateverTheTolerance) {
  const TriangleMesh mesh(ball(2, 0.1));
  TriangleSoup soup{mesh.structure().vertices, mesh.structure().triangles};
  EXPECT_EQ(models::weld_borders(soup, 1.0).corners, 0u);
  EXPECT_EQ(soup.triangles, mesh.structure().triangles);
}

TEST(MeshRepair, WeldsUpToTheToleranceAndNotBeyondIt) {
  constexpr double within_m = 1e-6;
  const double beyond_m = std::nextafter(within_m, 1.0);
  for (const auto& [apart_m, corners] : {std::pair(within_m, 2u), std::pair(beyond_m, 0u)}) {
    TriangleSoup soup{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, apart_m}, {1, 0, apart_m}, {0, -1, 0}},
                      {{0, 1, 2}, {4, 3, 5}}};
    const models::WeldedCorners welded = models::weld_borders(soup, within_m);
    EXPECT_EQ(welded.corners, corners);
    EXPECT_EQ(welded.apart_m, corners > 0 ? apart_m : 0.0);
  }
  TriangleSoup soup{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1e-9}, {1, 0, 1e-9}, {0, -1, 0}}, {{0, 1, 2}, {4, 3, 5}}};
  EXPECT_EQ(models::weld_borders(soup, 0.0).corners, 0u) << "0 turns it off";
}

TEST(MeshRepair, NeverMergesTwoCornersOfATriangleThatIsLargerThanTheTolerance) {
  TriangleSoup needle{{{0, 0, 0}, {0.5e-6, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  EXPECT_EQ(models::weld_borders(needle, 1e-6).corners, 0u);
  EXPECT_EQ(needle.triangles.size(), 1u);
  TriangleSoup speck{{{0, 0, 0}, {0.5e-6, 0, 0}, {0, 0.5e-6, 0}}, {{0, 1, 2}}};
  EXPECT_EQ(models::weld_borders(speck, 1e-6).collapsed, 1u);
  EXPECT_TRUE(speck.triangles.empty());
}

// A chain of corners, each within the tolerance of the next, over a slit of ten times that.
TEST(MeshRepair, DoesNotLetChainsOfNearCornersRunTogether) {
  TriangleSoup soup;
  for (int k = 0; k < 11; ++k) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    soup.vertices.insert(soup.vertices.end(), {{0.9e-6 * k, 0, 0}, {1, 0.1 * k, 0}, {1, 0.1 * k + 0.05, 0}});
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const models::WeldedCorners welded = models::weld_borders(soup, 1e-6);
  EXPECT_LE(welded.apart_m, 1e-6);
  EXPECT_EQ(welded.corners, 5u);
}

// 30,000 corners within one tolerance: as many faces around one tip, each with its own.
TEST(MeshRepair, TakesNoLongerForManyCornersAtOnePlace) {
  TriangleSoup soup;
  Random random(3);
  for (int k = 0; k < 30'000; ++k) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    const double angle = 2e-4 * k;
    soup.vertices.insert(soup.vertices.end(), {random.in_box<3>(1e-7),
                                               {std::cos(angle), std::sin(angle), 0.1},
                                               {std::cos(angle + 2e-4), std::sin(angle + 2e-4), 0.1}});
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  EXPECT_GT(models::weld_borders(soup, 1e-6).corners, 29'000u);
}

// Exports with each face twice told a penetration of 0 for a sphere that a tool was 156 µm inside of.
TEST(MeshRepair, LeavesOneOfFacesThatAreThereTwice) {
  const TriangleSoup ideal = ball(2, 0.1);
  for (const bool turned : {false, true}) {
    TriangleSoup soup = ideal;
    for (auto t : ideal.triangles) {
      if (turned) std::swap(t[0], t[1]);
      soup.triangles.push_back({t[1], t[2], t[0]});
    }
    const models::RepeatedFaces repeated = models::leave_out_repeated(soup);
    EXPECT_EQ(repeated.same, turned ? 0u : ideal.triangles.size());
    EXPECT_EQ(repeated.opposite, turned ? ideal.triangles.size() : 0u);
    const TriangleMesh mesh(std::move(soup));
    EXPECT_TRUE(mesh.closed());
    EXPECT_TRUE(mesh.encloses(Vec3::Zero()));
    EXPECT_NEAR(mesh.winding(Vec3::Zero()), 1.0, 1e-9) << "its fronts are outside";
  }
}

TEST(MeshRepair, GivesDoubleSidedFacesInAnyOrderOneFrontOutside) {
  const TriangleSoup ideal = ball(2, 0.1);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    TriangleSoup soup{ideal.vertices, {}};
    for (auto t : ideal.triangles) {
      if (random.uniform(0.0, 1.0) < 0.5) std::swap(t[0], t[1]);
      soup.triangles.push_back(t);
      std::swap(t[0], t[1]);
      soup.triangles.push_back(t);
    }
    models::leave_out_repeated(soup);
    const TriangleMesh mesh(std::move(soup));
    EXPECT_TRUE(mesh.closed()) << "seed " << seed;
    EXPECT_NEAR(mesh.winding(Vec3::Zero()), 1.0, 1e-9) << "seed " << seed;
  }
}

// Two boxes side by side with the same two triangles between them: each needs its side, to stay closed.
TEST(MeshRepair, KeepsBothFacesOfAWallBetweenTwoBodies) {
  TriangleSoup soup = block({0.1, 0.1, 0.1});
  for (int k = 0; k < 4; ++k)
    soup.vertices.push_back(soup.vertices[static_cast<std::size_t>(2 * k + 1)] + Vec3(0.1, 0, 0));
  const std::uint32_t over[] = {1, 8, 3, 9, 5, 10, 7, 11};  // the corners of the first box, seen from the second
  const std::size_t first = soup.triangles.size();
  for (std::size_t t = 0; t < first; ++t) {
    auto corners = soup.triangles[t];
    for (std::uint32_t& v : corners) v = over[v];
    // The second box's side of the wall has the first one's diagonal.
    const bool wall = std::all_of(corners.begin(), corners.end(), [](std::uint32_t v) { return v < 8; });
    if (!wall) soup.triangles.push_back(corners);
  }
  soup.triangles.push_back({1, 7, 3});
  soup.triangles.push_back({1, 5, 7});
  ASSERT_EQ(soup.triangles.size(), 24u);
  ASSERT_TRUE(TriangleMesh(soup).closed());
  const models::RepeatedFaces repeated = models::leave_out_repeated(soup);
  EXPECT_EQ(repeated.same + repeated.opposite, 0u);
  EXPECT_TRUE(TriangleMesh(soup).closed());
}

TEST(MeshRepair, TakesTheToleranceFromTheFilesRounding) {
  EXPECT_EQ(models::default_weld(1.0, 0.0), std::ldexp(1.0, -16)) << "a binary file";
  EXPECT_EQ(models::default_weld(1.0, 1e-9), std::ldexp(1.0, -16)) << "written finer than single precision";
  EXPECT_EQ(models::default_weld(1.0, 1e-4), 1.75e-4);
  EXPECT_EQ(models::default_weld(1.0, 1.0), 1.75 * std::ldexp(1.0, -10)) << "short numbers";
}

// Five faces, three of them at one edge: its outlines begin and end at edges of three faces. They were taken for loops,
// one of which had no length and a size of −nan.
TEST(MeshTopology, TellsBordersThatDoNotCloseByTheirEdges) {
  const TriangleMesh mesh({{{0.2, -0.1, -0.1},
                            {0.2, 0.1, -0.1},
                            {0.2, 0.1, 0.1},
                            {0.3, 0, -0.2},
                            {0.1, 0, -0.25},
                            {0.3, 0.2, 0},
                            {0.1, 0.25, 0}},
                           {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {1, 2, 5}, {1, 2, 6}}});
  const models::MeshTopology found = models::topology_of(mesh);
  std::size_t edges = 0;
  for (const models::MeshBorder& border : found.borders) {
    EXPECT_GT(border.length_m, 0.0);
    EXPECT_TRUE(std::isfinite(border.length_m) && border.centre.allFinite());
    edges += border.edges;
  }
  for (const models::MeshHole& hole : found.holes) {
    EXPECT_TRUE(std::isfinite(hole.size_m));
    EXPECT_GE(hole.loop.size(), 3u);
    edges += hole.loop.size();
  }
  EXPECT_EQ(edges, 9u) << "each edge of one face is in one of them";
  EXPECT_EQ(found.non_manifold.count, 2u);
}

// A walk that slid over some faces and is held by others says so: in a stack of sheets 10 µm apart, with friction.
TEST(MeshSurface, TellsWhatItReachedOverOtherFacesWithinTheStep) {
  TriangleSoup stack;
  for (int k = 0; k < 400; ++k) {
    const auto first = static_cast<std::uint32_t>(stack.vertices.size());
    const double z = 1e-5 * k;
    stack.vertices.insert(stack.vertices.end(), {{0, 0, z}, {0.1, 0, z}, {0, 0.1, z}});
    stack.triangles.push_back({first, first + 1, first + 2});
  }
  models::MeshSurface g(std::make_shared<const TriangleMesh>(std::move(stack)), 0.3);
  Random random(5);
  int reached = 0;
  for (int k = 0; k < 40'000; ++k) {
    const Vec3 x = Vec3(0.03, 0.03, 0.002) + random.in_box<3>(0.06);
    const Vec3 q = g(100.0, x + 0.02 * random.direction<3>(), x);
    const Vec3 r = g(100.0, q + random.uniform(0.0, 0.02) * random.direction<3>(), q);
    for (const auto& contact : g.contacts()) {
      if (!contact.reached) continue;
      ++reached;
      EXPECT_FALSE(contact.slips);
      EXPECT_NE(r, q);
    }
  }
  EXPECT_GT(reached, 0);
}

}  // namespace
}  // namespace proxarm::tests
