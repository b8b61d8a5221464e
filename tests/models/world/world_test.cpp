// Several obstacles at once.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "models/mesh/mesh_obstacle.hpp"
#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "tests/models/world/worlds.hpp"

namespace proxarm::tests {
namespace {

using models::BoxObstacle;
using models::PlaneObstacle;
using models::PointCore;
using models::Pose;
using models::Sphere;
using models::Vec3;
using models::World;

TEST(Contract, BodiesTogether) {
  expect_contract<3>(world(entry<Sphere>(0, PointCore{Vec3(0.25, 0, 0)}, 0.3, 0.3, false),
                           entry<Sphere>(1, PointCore{Vec3(-0.25, 0, 0)}, 0.3, 0.2, false),
                           entry<PlaneObstacle>(2, Vec3(0, 0, 0), Vec3(0, 0, 1), 0.1)),
                     small_steps({0.3, 0.2, 0.1}));
  expect_contract<3>(world(entry<Sphere>(0, PointCore{Vec3(0, 0, 0)}, 0.3, 0.3, true),
                           entry<PlaneObstacle>(1, Vec3(0, 0, -0.1), Vec3(0.1, 0, 1), 0.2)),
                     small_steps({0.3, 0.2}));
  ContractOptions<3> edges = small_steps({0.3, 0.2});
  edges.several = 2e-3;
  expect_contract<3>(world(entry<BoxObstacle>(0, Pose::Identity(), Vec3(0.4, 0.4, 0.4), 0.3),
                           entry<PlaneObstacle>(1, Vec3(0, 0, 0), Vec3(0, 0.1, 1), 0.2)),
                     edges);
}

// The box lets the proxy slide over its edge, the plane holds it beyond; each alone was refused because the straight
// way there passes the box. No set was complete, and what a shorter step touched was reported with a force that it
// couldn't bear.
TEST(World, GetsOverABoxesEdgeOntoThePlaneBeyond) {
  World g = world(entry<BoxObstacle>(0, Pose::Identity(), Vec3(0.4, 0.4, 0.4), 0.3),
                  entry<PlaneObstacle>(1, Vec3(0, 0, 0), Vec3(0, 0.1, 1), 0.2));
  const Vec3 q(0.2, 0.19901911828087324, -0.017404749897911184);
  const Vec3 p(0.18926960744093457, 0.2020816112095713, -0.022821072597969165);
  const double K = 22349.497;
  const Vec3 r = g(K, p, q);
  EXPECT_EQ(g.unresolved_steps(), 0u);
  ASSERT_EQ(g.contacts().size(), 1u);
  EXPECT_EQ(g.contacts()[0].object, 1);
  EXPECT_TRUE(obeys_17<3>(g.contacts(), small_steps({0.3, 0.2}), K, p, q, r)) << r.transpose();
  EXPECT_GT(r.y(), 0.2);
  EXPECT_LE(std::abs(r.z() + 0.1 * r.y()), 1e-15);
}

// Two moving planes had squeezed the proxy out of a box. When the box caught it again, far from where it was, the plane
// there hadn't been asked.
TEST(World, LooksAgainWhereAStepEndsFarFromWhereItBegan) {
  std::vector<World::Entry> entries;
  entries.push_back({std::make_unique<models::MovingObstacle>(
                         std::make_unique<PlaneObstacle>(Vec3::Zero(), Vec3::UnitX(), 0.1), models::ScriptedMotion{}),
                     0, -1});
  entries.push_back(entry<PlaneObstacle>(1, Vec3(0, 0, 0.1), Vec3(-0.1, 0, 1), 0.7));
  World g(std::move(entries));
  // A metre deep in the first; a step of a centimetre.
  const Vec3 r = g(100.0, Vec3(-1.01, 0, 0.01), Vec3(-1, 0, 0));
  EXPECT_EQ(g.unresolved_steps(), 0u);
  EXPECT_GE(r.x(), 0.0);
  EXPECT_GE(Vec3(-0.1, 0, 1).dot(r - Vec3(0, 0, 0.1)), -1e-15);
}

// It named only one of the faces that held the proxy in a mesh's valley.
TEST(World, NamesAllFacesOfAMeshThatHold) {
  const auto valley = std::make_shared<const models::TriangleMesh>(models::TriangleSoup{
      {Vec3(-1, -1, 0.5), Vec3(1, -1, 0.5), Vec3(-1, 0, 0), Vec3(1, 0, 0), Vec3(-1, 1, 0.5), Vec3(1, 1, 0.5)},
      {{0, 1, 3}, {0, 3, 2}, {2, 3, 5}, {2, 5, 4}}});
  World g =
      world(entry<models::MeshObstacle>(0, valley, 0.1), entry<PlaneObstacle>(1, Vec3(0, 0, -9), Vec3(0, 0, 1), 0));
  const Vec3 q = g(1.0, Vec3(0.3, 0, -0.1), Vec3(0.3, 0, 1));
  static_cast<void>(g(1.0, q + Vec3(0.01, 0, -0.1), q));
  ASSERT_EQ(g.contacts().size(), 2u);
  EXPECT_NE(g.contacts()[0].feature, g.contacts()[1].feature);
}

TEST(World, OfPlanesIsTheirComposition) {
  Random random(603);
  for (std::int64_t i = 0; i < scaled(300); ++i) {
    std::vector<models::Face> faces;
    std::vector<World::Entry> entries;
    for (int k = 0; k < 4; ++k) {
      const Vec3 n = (Vec3(0, 0, 1) + 0.8 * random.direction<3>()).normalized(), x = 0.1 * random.direction<3>();
      const double mu = random.uniform(0.0, 0.4);
      faces.push_back({models::FlatSurface<3>(x, n), mu});
      entries.push_back(entry<PlaneObstacle>(k, x, n, mu));
    }
    models::PlaneComposition exact(faces);
    World g(std::move(entries));
    Vec3 q(0, 0, 1);
    for (int k = 0; k < 50; ++k) {
      const Vec3 p = q + random.log_uniform(1e-6, 1.0) * (random.direction<3>() - Vec3(0, 0, 0.5)) - 0.1 * q;
      const Vec3 r = g(1.0, p, q);
      ASSERT_LE((r - exact(1.0, p, q)).norm(), 1e-13);
      q = r;
    }
  }
}

// Frictionless, two spheres in a plane: the proxy in the saddle between them is held by both, at the point that is
// computed by hand.
TEST(World, HoldsTheProxyBetweenTwoSpheres) {
  World g = world(entry<Sphere>(0, PointCore{Vec3(0.2, 0, 0)}, 0.25, 0.0, false),
                  entry<Sphere>(1, PointCore{Vec3(-0.2, 0, 0)}, 0.25, 0.0, false));
  Vec3 q(0.01, 0, 0.3);
  for (int k = 0; k < 200; ++k) q = g(1.0, q - Vec3(0, 0, 1e-3), q);
  EXPECT_LE((q - Vec3(0, 0, 0.15)).norm(), 1e-15);
  EXPECT_EQ(g.contacts().size(), 2u);
  EXPECT_EQ(g.unresolved_steps(), 0u);
}

TEST(World, NothingPassesThroughThinWalls) {
  Random random(604);
  World g = world(entry<BoxObstacle>(0, tilted({0, 0, 0}), Vec3(2.0, 2.0, 1e-5), 0.3),
                  entry<Sphere>(1, PointCore{Vec3::Zero()}, 0.5, 0.2, true));
  // Sealed by the sphere: what starts above the plate stays above it.
  const Vec3 up = tilted({0, 0, 0}).linear().col(2);
  Vec3 q = 0.1 * up;
  for (std::int64_t i = 0; i < scaled(300'000); ++i) {
    q = g(1.0, q + random.log_uniform(1e-9, 1.0) * random.direction<3>(), q);
    ASSERT_GE(up.dot(q), 0.5e-5 - 1e-13) << "step " << i;
    ASSERT_LE(q.norm(), 0.5 + 1e-13);
  }
  std::cout << "  unresolved " << g.unresolved_steps() << "\n";
}

TEST(World, IsAsCheapToAskForWhatIsFarAway) {
  // Not a timing: the same answers among ten thousand as alone.
  Random random(605);
  std::vector<World::Entry> many;
  for (int i = 0; i < 10'000; ++i) {
    Vec3 at = random.in_box<3>(5.0);
    if (at.norm() < 0.5) at += Vec3(1, 0, 0);
    many.push_back(entry<Sphere>(i + 1, PointCore{at}, 0.02, 0.2, false));
  }
  many.push_back(entry<Sphere>(0, PointCore{Vec3::Zero()}, 0.1, 0.3, false));
  World crowd(std::move(many));
  World alone = world(entry<Sphere>(0, PointCore{Vec3::Zero()}, 0.1, 0.3, false));
  Vec3 q(0, 0, 0.2);
  for (std::int64_t i = 0; i < scaled(20'000); ++i) {
    const Vec3 p = q + random.log_uniform(1e-7, 0.05) * random.direction<3>() - 0.02 * q;
    const Vec3 r = alone(1.0, p, q);
    ASSERT_EQ(crowd(1.0, p, q), r);
    q = r.norm() < 0.3 ? r : Vec3(0, 0, 0.2);
  }
}

// What is asked with numbers that are none may give none, but leaves nothing behind.
TEST(World, ForgetsANonFiniteStep) {
  auto g = single(std::make_unique<Sphere>(PointCore{Vec3::Zero()}, 0.1, 0.3, false));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Vec3 p(0.01, 0, 0.09), q(0, 0, 0.12), far(0, 0, 5);
  const Vec3 expected = (*g)(1e6, p, q);
  for (const Vec3& bad : {Vec3(nan, 0, 0), Vec3(0, 0, std::numeric_limits<double>::infinity())}) {
    (*g)(1e6, bad, q);
    (*g)(1e6, p, bad);
    EXPECT_EQ((*g)(1e6, p, q), expected);
    EXPECT_EQ((*g)(1e6, far, far), far);
  }
}

}  // namespace
}  // namespace proxarm::tests
