// Which triangles of two meshes come near each other, against distances of many points of each.
#include "models/rigid_features/mesh_pairs.hpp"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "models/base/random.hpp"
#include "models/rigid_features/near_lists.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"

namespace proxarm::models {
namespace {

using Faces = std::pair<std::uint32_t, std::uint32_t>;

struct Flat {
  TriangleMesh mesh;
  NodeDiscs discs;
  explicit Flat(TriangleSoup soup) : mesh(std::move(soup)), discs(mesh) {}
  [[nodiscard]] FlatMesh both() const { return {mesh, discs}; }
};

TriangleSoup shifted(TriangleSoup soup, const Vec3& by) {
  for (Vec3& v : soup.vertices) v += by;
  return soup;
}

// Fine and coarse, with slivers and needles, flat and far from the origin; single triangles; triangles in any order.
TriangleSoup random_soup(Random& random) {
  const auto bumpy = [](double theta, double phi) {
    return 0.02 * (1.0 + 0.2 * std::sin(3.0 * theta) * std::cos(2.0 * phi));
  };
  const auto leaf = [](double theta, double) { return 0.02 * (1.0 - 0.999 * std::abs(std::cos(theta))); };
  switch (random.below(6)) {
    case 0:
      return tests::globe(9, 14, bumpy);
    case 1:
      return tests::globe(5, 40, bumpy, 0.3);
    case 2:
      return tests::globe(6, 12, leaf);
    case 3:
      return shifted(tests::globe(7, 9, bumpy), random.in_box(100.0));
    case 4:
      return {{random.in_box(0.02), random.in_box(0.02), random.in_box(0.02)}, {{0, 1, 2}}};
    default: {
      TriangleSoup soup;
      const int count = 1 + random.below(60);
      for (int i = 0; i < count; ++i) {
        const auto first = static_cast<std::uint32_t>(soup.vertices.size());
        const Vec3 middle = random.in_box(0.03);
        for (int k = 0; k < 3; ++k) soup.vertices.push_back(middle + random.in_box(random.chance(0.1) ? 0.03 : 0.003));
        soup.triangles.push_back({first, first + 1, first + 2});
      }
      return soup;
    }
  }
}

// An upper bound of the distance between two triangles.
double at_most_apart(const TriangleMesh& a, std::uint32_t i, const TriangleMesh& b, std::uint32_t j, const View& at) {
  static constexpr double n = 4.0;
  const auto points = [](const TriangleMesh& mesh, std::uint32_t face) {
    std::vector<Vec3> out;
    for (double p = 0.0; p <= n; ++p) {
      for (double q = 0.0; p + q <= n; ++q) {
        out.push_back((p * mesh.corner(face, 0) + q * mesh.corner(face, 1) + (n - p - q) * mesh.corner(face, 2)) / n);
      }
    }
    return out;
  };
  double least = std::numeric_limits<double>::infinity();
  for (const Vec3& x : points(a, i)) {
    for (const Vec3& y : points(b, j)) least = std::min(least, (at * x - y).norm());
  }
  return least;
}

std::set<Faces> near_ones(const TriangleMesh& a, const TriangleMesh& b, const View& at, double near) {
  std::set<Faces> out;
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    for (std::uint32_t j = 0; j < b.size(); ++j) {
      if (at_most_apart(a, i, b, j, at) <= near) out.insert({i, j});
    }
  }
  return out;
}

View beside(Random& random, const Flat& own, const Flat& other) {
  const Vec3 middle = 0.5 * (own.mesh.bounds().low + own.mesh.bounds().high);
  const Vec3 there = 0.5 * (other.mesh.bounds().low + other.mesh.bounds().high);
  View at;
  at.R = rotation_by(random.in_box(3.0)).toRotationMatrix();
  at.x = there + random.arrow(0.0, 0.05) - at.R * middle;
  return at;
}

template <typename Each>
std::set<Faces> visited(Each each) {
  std::set<Faces> out;
  each([&](std::uint32_t own, std::uint32_t other) {
    EXPECT_TRUE(out.insert({own, other}).second) << "twice";
    return true;
  });
  return out;
}

TEST(NodeDisc, HoldsAllVerticesOfItsTriangles) {
  Random random(1);
  for (int run = 0; run < 200; ++run) {
    const Flat flat(random_soup(random));
    const auto& nodes = flat.mesh.structure().nodes;
    for (std::uint32_t i = 0; i < 2 * nodes.size(); ++i) {
      const std::uint32_t first = nodes[i / 2].first[i % 2], count = nodes[i / 2].count[i % 2];
      const NodeDisc& disc = flat.discs.of(i);
      for (std::uint32_t f = first; f < first + count; ++f) {
        for (const std::size_t k : {0U, 1U, 2U}) {
          const Eigen::Matrix<long double, 3, 1> way = (flat.mesh.corner(f, k) - disc.middle).cast<long double>();
          const Eigen::Matrix<long double, 3, 1> axis = disc.axis.cast<long double>();
          EXPECT_LE(std::abs(axis.dot(way)), disc.half);
          EXPECT_LE((way - axis.dot(way) * axis).norm(), disc.radius);
          EXPECT_LE(way.norm(), disc.ball);
        }
      }
      // And all that is within it.
      if (count > 0 || i == 1) continue;
      for (const std::uint32_t k : {0U, 1U}) {
        const NodeDisc& within = flat.discs.of(2 * first + k);
        EXPECT_FALSE(apart(disc, within, 0.0));
      }
    }
  }
}

TEST(NodeDisc, IsThinWhereAMeshIsFlatHoweverItLeans) {
  TriangleSoup soup;
  const Eigen::Matrix3d R = rotation_by(Vec3(0.4, -0.9, 0.2)).toRotationMatrix();
  for (std::uint32_t i = 0; i < 20; ++i) {
    for (std::uint32_t j = 0; j < 20; ++j) soup.vertices.push_back(R * Vec3(1e-3 * i, 1e-3 * j, 0.0));
  }
  for (std::uint32_t i = 0; i + 1 < 20; ++i) {
    for (std::uint32_t j = 0; j + 1 < 20; ++j) {
      const std::uint32_t at = 20 * i + j;
      soup.triangles.push_back({at, at + 20, at + 21});
      soup.triangles.push_back({at, at + 21, at + 1});
    }
  }
  const Flat flat(soup), other(shifted(soup, R * Vec3(0.0, 0.0, 1e-4)));
  EXPECT_LT(flat.discs.of(2).half, 1e-15);  // of 361 triangles
  // Two sheets at a tenth of a millimetre: no leaf is within less than that, all are within more.
  std::size_t leaves = 0;
  const auto count = [&](const MeshPairs::Leaves&) { return ++leaves > 0; };
  MeshPairs(flat.both(), other.both(), {}, 0.999e-4).list(count);
  EXPECT_EQ(leaves, 0U);
  MeshPairs(flat.both(), other.both(), {}, 1.001e-4).list(count);
  EXPECT_GE(leaves, flat.mesh.size() / 4);
}

TEST(MeshPairs, VisitsAllTrianglesThatComeNearAndNoneTwice) {
  Random random(2);
  std::size_t seen = 0;
  for (int run = 0; run < 60; ++run) {
    const Flat own(random_soup(random)), other(random_soup(random));
    const View at = beside(random, own, other);
    const double near = random.chance(0.2) ? 0.0 : random.log_uniform(1e-6, 1e-2);
    const std::set<Faces> wanted = near_ones(own.mesh, other.mesh, at, near);
    const std::set<Faces> found =
        visited([&](auto visit) { MeshPairs(own.both(), other.both(), at, near).each(visit); });
    EXPECT_TRUE(std::includes(found.begin(), found.end(), wanted.begin(), wanted.end())) << "run " << run;
    seen += wanted.size();
  }
  EXPECT_GT(seen, 1000U);
}

// A list is made once, and asked around poses at which nothing comes further than it looked.
TEST(MeshPairs, OfAListVisitsWhatComesNearAtPosesNearby) {
  Random random(3);
  std::size_t seen = 0;
  for (int run = 0; run < 60; ++run) {
    const Flat own(random_soup(random)), other(random_soup(random));
    const View at = beside(random, own, other);
    const double reach = random.log_uniform(1e-5, 1e-2);
    NearLeaves list;
    list.make_room(1U << 16U, 1);
    list.begin({}, reach);
    list.begin_with(0, 0);
    MeshPairs(own.both(), other.both(), at, reach).list([&](const MeshPairs::Leaves& two) { return list.add(two); });
    ASSERT_TRUE(list.all());
    // About the own mesh's middle, so that no point goes further than the way and the turn times its ball.
    const Vec3 middle = own.discs.of(0).middle;
    const double share = random.uniform(0.0, 1.0), ball = own.discs.of(0).ball;
    const Vec3 way = random.arrow(0.0, 0.5 * share * reach);
    const Eigen::Matrix3d turn = rotation_by(random.arrow(0.0, 0.5 * share * reach / ball)).toRotationMatrix();
    View now;
    now.R = turn * at.R;
    now.x = at * middle + way - now.R * middle;
    const double near = (1.0 - share) * reach;
    const std::set<Faces> wanted = near_ones(own.mesh, other.mesh, now, near);
    const std::set<Faces> found = visited(
        [&](auto visit) { MeshPairs(own.both(), other.both(), now, near).each_of(list.of(0, 0).value(), visit); });
    EXPECT_TRUE(std::includes(found.begin(), found.end(), wanted.begin(), wanted.end())) << "run " << run;
    seen += wanted.size();
  }
  EXPECT_GT(seen, 300U);
}

TEST(MeshPairs, EndsWhereItIsTold) {
  Random random(4);
  const Flat own(tests::globe(9, 14, [](double, double) { return 0.02; }));
  int visits = 0;
  MeshPairs(own.both(), own.both(), {}, 1e-3).each([&](std::uint32_t, std::uint32_t) { return ++visits < 3; });
  EXPECT_EQ(visits, 3);
}

TEST(NearLeaves, WithoutRoomForAllSaysSo) {
  NearLeaves list;
  EXPECT_FALSE(list.has_room());
  EXPECT_FALSE(list.all());
  list.make_room(2, 2);
  list.begin({}, 1.0);
  list.begin_with(0, 3);
  EXPECT_TRUE(list.add({1, 2}));
  list.begin_with(1, 3);
  EXPECT_TRUE(list.add({3, 4}));
  EXPECT_TRUE(list.all());
  ASSERT_EQ(list.of(1, 3).value().size(), 1U);
  EXPECT_EQ(list.of(1, 3).value()[0].own, 3U);
  EXPECT_FALSE(list.of(0, 4)) << "of those there is no list, which says nothing";
  EXPECT_FALSE(list.add({5, 6}));
  EXPECT_FALSE(list.all());
}

}  // namespace
}  // namespace proxarm::models
