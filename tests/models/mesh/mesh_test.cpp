// Triangle meshes: built, refused, and asked what is near.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>

#include "models/mesh/mesh.hpp"
#include "models/mesh/mesh_surface.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/exact_reference.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::tests {
namespace {

using models::MeshSurface;
using models::TriangleMesh;
using models::TriangleSoup;
using models::Vec3;

std::shared_ptr<const TriangleMesh> mesh_of(TriangleSoup soup) {
  return std::make_shared<const TriangleMesh>(std::move(soup));
}

TEST(TriangleMesh, RefusesWhatIsNoMesh) {
  const double nan = std::nan("");
  EXPECT_THROW(TriangleMesh(TriangleSoup{}), std::invalid_argument);
  EXPECT_THROW(TriangleMesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}}}), std::invalid_argument);
  EXPECT_THROW(TriangleMesh({{{0, 0, 0}, {1, 0, 0}, {0, nan, 0}}, {{0, 1, 2}}}), std::invalid_argument);
  EXPECT_THROW(TriangleMesh({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}), std::invalid_argument) << "no area";
  EXPECT_THROW(MeshSurface(mesh_of(block({1, 1, 1})), -0.1), std::invalid_argument);
  EXPECT_THROW(MeshSurface(mesh_of(block({1, 1, 1})), nan), std::invalid_argument);
}

TEST(TriangleMesh, WeldsVerticesAndDropsTrianglesWithoutArea) {
  TriangleSoup soup;
  for (const auto& t : block({1, 1, 1}).triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const auto v : t) soup.vertices.push_back(block({1, 1, 1}).vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
    soup.triangles.push_back({first, first + 1, first + 1});
  }
  const TriangleMesh mesh(soup);
  EXPECT_EQ(mesh.size(), 12u);
  EXPECT_EQ(mesh.dropped_triangles(), 12u);
  EXPECT_TRUE(mesh.closed());
  EXPECT_NEAR(mesh.winding({0.1, 0.2, 0.3}), 1.0, 1e-12);
  EXPECT_NEAR(mesh.winding({0.1, 0.2, 0.6}), 0.0, 1e-12);
  Random random(700);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x = random.in_box<3>(1.0);
    ASSERT_EQ(mesh.encloses(x), x.cwiseAbs().maxCoeff() < 0.5);
  }
  soup.triangles.pop_back();
  soup.triangles.pop_back();
  EXPECT_FALSE(TriangleMesh(soup).closed());
}

// What a file says of it may be anything: refused, or of no consequence but wrong answers.
TEST(TriangleMesh, RefusesADamagedStructure) {
  const TriangleMesh mesh(ball(2, 0.5));
  const auto refused = [](TriangleMesh::Structure structure) {
    EXPECT_THROW((void)TriangleMesh::restored(std::move(structure)), std::invalid_argument);
  };
  auto s = mesh.structure();
  refused({});
  s.vertices.pop_back();
  refused(s);
  s = mesh.structure();
  s.triangles.pop_back();
  refused(s);
  s = mesh.structure();
  s.nodes[0].first[0] = 0;
  refused(s);
  s = mesh.structure();
  s.nodes.pop_back();
  refused(s);
  s = mesh.structure();
  s.vertices[7].y() = std::nan("");
  refused(s);

  Random random(704);
  std::int64_t taken = 0;
  for (std::int64_t i = 0; i < scaled(3000); ++i) {
    s = mesh.structure();
    auto& pair = s.nodes[static_cast<std::size_t>(random.below(static_cast<int>(s.nodes.size())))];
    std::array<unsigned char, sizeof(pair)> bytes{};
    std::memcpy(bytes.data(), static_cast<const void*>(&pair), sizeof(pair));
    for (int k = 0; k < 3; ++k) {
      bytes[static_cast<std::size_t>(random.below(sizeof(pair)))] = static_cast<unsigned char>(random.below(256));
    }
    std::memcpy(static_cast<void*>(&pair), bytes.data(), sizeof(pair));
    try {
      const TriangleMesh same = TriangleMesh::restored(std::move(s));
      ++taken;
      std::uint32_t near = 0;
      const Vec3 x = random.in_box<3>(1.0), y = random.in_box<3>(1.0);
      EXPECT_GE(same.distance(x, 1e9, near), 0.0);
      EXPECT_LT(near, same.size());
      EXPECT_LT(same.first_hit(x, y).face, same.size());
    } catch (const std::invalid_argument&) {
    }
  }
  EXPECT_GT(taken, scaled(100) / 2);
}

TEST(TriangleMesh, FindsTheNearestFaceAndTheFirstHit) {
  Random random(702);
  TriangleSoup soup;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const Vec3 at = random.in_box<3>(1.0);
    const double size = random.log_uniform(1e-4, 0.5);
    for (int k = 0; k < 3; ++k) soup.vertices.push_back(at + size * random.in_box<3>(1.0));
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const TriangleMesh mesh(soup);
  std::uint32_t near = 0;
  for (std::int64_t i = 0; i < scaled(5000); ++i) {
    const Vec3 x = random.in_box<3>(1.5), y = x + random.log_uniform(1e-3, 2.0) * random.direction<3>();
    // A long double walk over all: the nearest of many points wouldn't be exact, so by the plane and by the sides.
    Real least = 1e9L;
    bool any = false;
    std::uint32_t brute = 0;
    Real brute_share = 2.0L;
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
      const RVec p = x.cast<Real>(), v[3] = {mesh.corner(f, 0).cast<Real>(), mesh.corner(f, 1).cast<Real>(),
                                             mesh.corner(f, 2).cast<Real>()};
      const RVec n = (v[1] - v[0]).cross(v[2] - v[0]).normalized();
      bool within = true;
      for (int k = 0; k < 3; ++k) {
        const RVec e = v[(k + 1) % 3] - v[k], d = p - v[k];
        within = within && e.cross(n).dot(d) <= 0;
        least = std::min(least, (d - e * std::clamp(e.dot(d) / e.squaredNorm(), Real(0), Real(1))).norm());
      }
      if (within) least = std::min(least, std::abs(n.dot(p - v[0])));
      if (mesh.touched_by(f, x, y)) {
        any = true;
        const Real fall = n.dot(p - y.cast<Real>()), share = n.dot(p - v[0]) / fall;
        if (share < brute_share) {
          brute_share = share;
          brute = f;
        }
      }
    }
    ASSERT_NEAR(mesh.distance(x, 1e9, near), static_cast<double>(least), 1e-14);
    const TriangleMesh::Hit hit = mesh.first_hit(x, y);
    ASSERT_EQ(hit.any(), any);
    if (any) {
      ASSERT_EQ(hit.face, brute);
      ASSERT_NEAR(hit.share, static_cast<double>(brute_share), 1e-12);
    }
  }
}

}  // namespace
}  // namespace proxarm::tests
