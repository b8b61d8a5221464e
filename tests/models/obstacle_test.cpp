// Spheres, capsules, bars, boxes and cylinders, alone and together.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "models/box_obstacle.hpp"
#include "models/cylinder_obstacle.hpp"
#include "models/mesh_obstacle.hpp"
#include "models/moving_obstacle.hpp"
#include "models/plane_composition.hpp"
#include "models/world.hpp"
#include "tests/models/contract.hpp"

namespace proxarm::tests {
namespace {

using models::BoxObstacle;
using models::Capsule;
using models::CylinderObstacle;
using models::Layer;
using models::LineCore;
using models::Obstacle;
using models::PlaneObstacle;
using models::PointCore;
using models::Pose;
using models::RoundBar;
using models::SegmentCore;
using models::Sphere;
using models::Vec3;
using models::World;

template <typename T, typename... Arguments>
World::Entry entry(std::int32_t object, Arguments&&... arguments) {
  return {std::make_unique<T>(std::forward<Arguments>(arguments)...), object, -1};
}

template <typename... Entries>
World world(Entries&&... entries) {
  std::vector<World::Entry> all;
  (all.push_back(std::forward<Entries>(entries)), ...);
  return World(std::move(all));
}

Pose tilted(const Vec3& at) {
  Pose X = Pose::Identity();
  X.translation() = at;
  X.linear() = (Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())).toRotationMatrix();
  return X;
}

// States small against the radii: deeper ones have several solutions on a solid body (a proxy that is pushed through
// the middle of a ball may hold or go around either way).
template <int N = 3>
ContractOptions<3> small_steps(std::vector<double> friction, double depth = 0.02) {
  ContractOptions<3> options;
  options.friction = std::move(friction);
  options.size_m = depth;
  options.near_surface = true;
  options.kappa_decades = 6.0;
  options.reach_m = depth;
  options.condition = 4.0;
  return options;
}

TEST(Contract, RoundBodies) {
  for (const double mu : {0.0, 0.3, 1.0}) {
    expect_contract<3>(world(entry<Sphere>(0, PointCore{Vec3(0.1, 0.2, 0.3)}, 0.3, mu, false)), small_steps({mu}));
    expect_contract<3>(world(entry<Sphere>(0, PointCore{Vec3(0.1, 0.2, 0.3)}, 0.3, mu, true)), small_steps({mu}));
    expect_contract<3>(world(entry<Capsule>(0, SegmentCore({0, 0, 0}, {0.2, 0.1, 0}), 0.2, mu, false)),
                       small_steps({mu}));
    expect_contract<3>(world(entry<Capsule>(0, SegmentCore({0, 0, 0}, {0.2, 0.1, 0}), 0.2, mu, true)),
                       small_steps({mu}));
    expect_contract<3>(world(entry<RoundBar>(0, LineCore{Vec3(0, 0.1, 0), Vec3(1, 2, 2) / 3.0}, 0.2, mu, true)),
                       small_steps({mu}));
  }
}

TEST(Contract, BodiesWithEdges) {
  for (const double mu : {0.0, 0.3}) {
    // At a convex edge a proxy that comes from beside it may be held, or slide on either face.
    ContractOptions<3> edges = small_steps({mu});
    edges.several = 2e-3;
    expect_contract<3>(world(entry<BoxObstacle>(0, tilted({0.1, 0.2, 0.3}), Vec3(0.4, 0.5, 0.6), mu)), edges);
    expect_contract<3>(world(entry<CylinderObstacle>(0, Vec3(0, 0, -0.2), Vec3(0.1, 0, 0.2), 0.25, mu)), edges);
  }
}

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

// On a sphere friction has a closed form: the force makes the angle β = atan μ with the normal, so the line of the
// force passes the centre at R sin β, and the proxy stops where it does. All in the plane of p, q and the centre.
TEST(Sphere, SlidesToTheFrictionCircle) {
  Random random(601);
  for (std::int64_t i = 0; i < scaled(50'000); ++i) {
    const bool inside = random.chance(0.5);
    const double mu = random.uniform(0.0, 1.0), R = random.log_uniform(0.01, 1.0), beta = std::atan(mu);
    const Vec3 centre = random.in_box<3>(0.5);
    const Sphere sphere(PointCore{centre}, R, mu, inside);
    const Vec3 x = random.direction<3>(), y = x.cross(random.direction<3>()).normalized();
    // q at angle 0, p at angle φ and at d from the centre.
    const double phi = random.log_uniform(1e-6, 0.5), depth = random.log_uniform(1e-6, 0.3) * R;
    const double d = inside ? R + depth : R - depth;
    const Vec3 q = centre + R * x, p = centre + d * (std::cos(phi) * x + std::sin(phi) * y);
    const Obstacle::Step s = sphere.step(1.0, p, q);
    ASSERT_TRUE(s.touches);
    const double reach = inside ? beta - std::asin(R / d * std::sin(beta)) : std::asin(R / d * std::sin(beta)) - beta;
    const double theta = R / d * std::sin(beta) >= 1.0 ? 0.0 : std::max(0.0, phi - reach);
    const Vec3 expected = centre + R * (std::cos(theta) * x + std::sin(theta) * y);
    // asin loses half the digits where its argument nears one: not in these states (d ≥ 0.7 R, β ≤ 45°), but its
    // derivative reaches 10.
    ASSERT_LE((s.r - expected).norm(), 1e-14) << "inside " << inside << " μ " << mu << " R " << R << " φ " << phi;
  }
}

// From far beyond a cavity, p and q lie on opposite sides of its middle and the way between them passes that closely:
// there the proxy turns around within a tiny part of the way. Counted from p, or in coordinates of W, that part was
// lost in rounding, and the force left its friction cone altogether.
TEST(RoundBodies, SlideToTheFrictionConeFromFarBeyondACavity) {
  Random random(606);
  const auto slide = [](const auto& core, double R, double mu, const Vec3& p, const Vec3& q) {
    const models::RoundObstacle cavity(core, R, mu, true);
    const Obstacle::Step s = cavity.step(1.0, p, q);
    ASSERT_EQ(s.touches, cavity.distance(p) < 0.0);  // along an endless bar it may be inside
    if (!s.touches) return;
    const Vec3 f = s.r - p, n = s.normal, f_t = f - n * n.dot(f), d = s.r - q, v = d - n * n.dot(d);
    // Rounding of p, and of q beside the slip's length, with the 64 units that all laws are judged by.
    const double small = 64.0 * std::numeric_limits<double>::epsilon();
    const double size = f.norm() + 1.0, uncertain = small / (v.norm() + 1e-300);
    ASSERT_LE(f_t.norm(), mu * n.dot(f) + small * size);
    if (!s.slips) return;
    ASSERT_NEAR(f_t.norm(), mu * n.dot(f), small * size);
    ASSERT_LE((f_t.normalized() + v.normalized()).norm(), uncertain + small * size / f_t.norm());
  };
  for (std::int64_t i = 0; i < scaled(20'000); ++i) {
    const double R = random.uniform(0.3, 1.0), mu = random.uniform(0.05, 1.2);
    const Vec3 a = random.in_box<3>(0.3), b = random.in_box<3>(0.3);
    const Vec3 middle = a + random.uniform(0.0, 1.0) * (b - a);
    const Vec3 q = middle + random.uniform(0.1, 0.3) * random.direction<3>();
    // Past the middle by what is above rounding of a way of some metres, to 0.1 m.
    const Vec3 through = middle + random.log_uniform(1e-14, 0.1) * random.direction<3>();
    const Vec3 p = through + random.log_uniform(3.0, 1e6) * (through - q).normalized();
    const Vec3 axis = (b - a).normalized();
    slide(PointCore{middle}, R, mu, p, q);
    // On a way along the axis, rounding of what is along decides on the side.
    if (axis.cross((p - q).normalized()).norm() < 0.3) continue;
    slide(SegmentCore(a, b), R, mu, p, q);
    slide(models::LineCore{a, axis}, R, mu, p, q);
    if (HasFatalFailure()) FAIL() << "state " << i;
  }
}

TEST(Sphere, LetsTheProxyGoAround) {
  const Sphere sphere(PointCore{Vec3::Zero()}, 0.1, 0.1, false);
  EXPECT_FALSE(sphere.step(1.0, {0.5, 0, 0}, {-0.5, 0.15, 0}).touches) << "slides past";
  EXPECT_TRUE(sphere.step(1.0, {0.5, 0.001, 0}, {-0.5, 0, 0}).touches) << "holds what is pushed straight through";
}

TEST(Bodies, StickBitForBitAndNeverCreep) {
  Random random(602);
  std::vector<World> worlds;
  worlds.push_back(world(entry<Sphere>(0, PointCore{Vec3(0.1, 0.2, 0.3)}, 0.3, 0.3, false)));
  worlds.push_back(world(entry<Capsule>(0, SegmentCore({0, 0, 0}, {0.2, 0.1, 0}), 0.2, 0.3, true)));
  worlds.push_back(world(entry<BoxObstacle>(0, tilted({0.1, 0.2, 0.3}), Vec3(0.4, 0.5, 0.6), 0.3)));
  worlds.push_back(world(entry<CylinderObstacle>(0, Vec3(0, 0, -0.2), Vec3(0.1, 0, 0.2), 0.25, 0.3)));
  for (World& g : worlds) {
    for (std::int64_t i = 0; i < scaled(2000); ++i) {
      Vec3 q = random.in_box<3>(1.0);
      q = g(1e6, q + 2.0 * random.direction<3>(), q);
      if (g.contacts().empty()) continue;
      q = g(1e6, q - 1e-6 * g.contacts()[0].normal, q);
      const Vec3 start = q;
      // Not at an edge, where a push sideways leads past it into the open.
      bool at_edge = false;
      for (int k = 0; k < 8 && !g.contacts().empty(); ++k) {
        const Vec3 t = g.contacts()[0].normal.cross(random.direction<3>()).normalized();
        at_edge = at_edge || std::abs(g.distance(q + 1e-4 * t)) > 1e-7;
      }
      if (at_edge) continue;
      for (int k = 0; k < 20 && !g.contacts().empty(); ++k) {
        const Vec3 n = g.contacts()[0].normal;
        const double push = random.uniform(0.01, 50.0);
        q = g(1e6, q + (random.uniform(0.0, 0.299 * push) * n.cross(random.direction<3>()) - push * n) / 1e6, q);
      }
      ASSERT_EQ(q, start) << "world " << &g - worlds.data() << " off by " << (q - start).norm() << ", " << i;
    }
  }
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

TEST(Layer, GivesWayByForceOverStiffness) {
  const Layer layer{1000.0, 0.01};
  const PlaneObstacle plane(Vec3::Zero(), Vec3::UnitZ(), 0.3, layer);
  const double K = 1e6;
  // 5 N on 1000 N/m: 5 mm.
  const Vec3 q(0, 0, -0.005), p = q - Vec3(0, 0, 5.0 / K);
  EXPECT_NEAR(plane.step(K, p, q).r.z(), -0.005, 1e-15);
  // 20 N: the layer is used up at 10 mm.
  EXPECT_NEAR(plane.step(K, Vec3(0, 0, -0.01 - 20.0 / K), q).r.z(), -0.01, 1e-15);
  const Sphere sphere(PointCore{Vec3::Zero()}, 0.1, 0.3, false, layer);
  EXPECT_NEAR(sphere.step(K, Vec3(0, 0, 0.095 - 5.0 / K), Vec3(0, 0, 0.095)).r.z(), 0.095, 1e-15);
  const BoxObstacle box(Pose::Identity(), Vec3(0.2, 0.2, 0.2), 0.3, layer);
  EXPECT_NEAR(box.step(K, Vec3(0, 0, 0.095 - 5.0 / K), Vec3(0, 0, 0.095)).r.z(), 0.095, 1e-15);
  EXPECT_NEAR(box.step(K, Vec3(0, 0, 0.09 - 20.0 / K), Vec3(0, 0, 0.095)).r.z(), 0.09, 1e-15);
}

TEST(Contract, Layers) {
  const Layer layer{2000.0, 0.01};
  ContractOptions<3> options = small_steps({0.3});
  options.soft = true;
  options.several = 2e-3;  // at edges, as without layers
  expect_contract<3>(world(entry<PlaneObstacle>(0, Vec3(0.1, 0, 0), Vec3(1, 2, 3), 0.3, layer)), options);
  expect_contract<3>(world(entry<Sphere>(0, PointCore{Vec3(0.1, 0.2, 0.3)}, 0.3, 0.3, false, layer)), options);
  expect_contract<3>(world(entry<Sphere>(0, PointCore{Vec3(0.1, 0.2, 0.3)}, 0.3, 0.3, true, layer)), options);
  expect_contract<3>(world(entry<BoxObstacle>(0, tilted({0.1, 0.2, 0.3}), Vec3(0.4, 0.5, 0.6), 0.3, layer)), options);
  expect_contract<3>(world(entry<CylinderObstacle>(0, Vec3(0, 0, -0.2), Vec3(0.1, 0, 0.2), 0.25, 0.3, layer)), options);
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

}  // namespace
}  // namespace proxarm::tests
