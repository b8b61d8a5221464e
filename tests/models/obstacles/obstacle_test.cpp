// What all obstacles have in common: edges, sticking, elastic layers.
#include <gtest/gtest.h>

#include <cmath>

#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/cylinder_obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "tests/models/world/worlds.hpp"

namespace proxarm::tests {
namespace {

using models::BoxObstacle;
using models::Capsule;
using models::CylinderObstacle;
using models::Layer;
using models::PlaneObstacle;
using models::PointCore;
using models::Pose;
using models::SegmentCore;
using models::Sphere;
using models::Vec3;
using models::World;

TEST(Contract, BodiesWithEdges) {
  for (const double mu : {0.0, 0.3}) {
    // At a convex edge a proxy that comes from beside it may be held, or slide on either face.
    ContractOptions<3> edges = small_steps({mu});
    edges.several = 2e-3;
    expect_contract<3>(world(entry<BoxObstacle>(0, tilted({0.1, 0.2, 0.3}), Vec3(0.4, 0.5, 0.6), mu)), edges);
    expect_contract<3>(world(entry<CylinderObstacle>(0, Vec3(0, 0, -0.2), Vec3(0.1, 0, 0.2), 0.25, mu)), edges);
  }
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

}  // namespace
}  // namespace proxarm::tests
