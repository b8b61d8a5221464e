// Meshes that move: as other moving objects do, with a surface that has no inside.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "models/mesh/mesh_obstacle.hpp"
#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/world/world.hpp"
#include "tests/allocation_count.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {
namespace {

using namespace models;  // NOLINT: the whole folder is under test

std::unique_ptr<World> moving(std::unique_ptr<Obstacle> obstacle, const ScriptedMotion& motion) {
  std::vector<World::Entry> entries;
  entries.push_back({std::make_unique<MovingObstacle>(std::move(obstacle), motion), 0, -1});
  return std::make_unique<World>(std::move(entries));
}

std::unique_ptr<MeshObstacle> mesh_of(const TriangleSoup& soup, double friction) {
  return std::make_unique<MeshObstacle>(std::make_shared<const TriangleMesh>(soup), friction);
}

// A box object and the same box as twelve triangles, pushed about on by the same forces while they fly and turn. They
// are apart by the mesh's lift (5e-13 m at these coordinates), which friction doesn't let grow.
TEST(MovingMesh, IsAMovingBoxWhereItIsOne) {
  Random random(821);
  const Vec3 size(0.6, 0.5, 0.2);
  std::size_t contacts = 0;
  for (int world = 0; world < 40; ++world) {
    ScriptedMotion motion;
    motion.velocity_m_per_s = random.uniform(0.0, 2.0) * random.direction<3>();
    motion.velocity_m_per_s.z() = std::abs(motion.velocity_m_per_s.z());  // towards the proxy
    motion.amplitude_m = 0.01 * random.direction<3>();
    motion.frequency_Hz = random.uniform(0.5, 5.0);
    motion.axis = Vec3::UnitZ();
    motion.turn_rad_per_s = random.uniform(-3.0, 3.0);
    const double mu = world % 4 == 0 ? 0.0 : random.uniform(0.1, 0.9);
    const auto box = moving(std::make_unique<BoxObstacle>(Pose::Identity(), size, mu), motion);
    const auto mesh = moving(mesh_of(block(size), mu), motion);
    const double T = 1e-3;
    Vec3 q_box = motion.at(0.0) * Vec3(0.05, 0.02, 0.1 + 1e-4), q_mesh = q_box;
    for (int k = 1; k <= 500; ++k) {
      const Pose X = motion.at(k * T);
      if (!((X.inverse(Eigen::Isometry) * q_box).head<2>().norm() < 0.2)) break;  // off to the edges
      const Vec3 push = 1e-5 * random.direction<3>() - X.linear().col(2) * random.uniform(0.0, 1e-4);
      for (const auto& g : {box.get(), mesh.get()}) g->set_time({.time_s = k * T, .period_s = T});
      q_box = (*box)(1e6, q_box + push, q_box);
      q_mesh = (*mesh)(1e6, q_mesh + push, q_mesh);
      ASSERT_EQ(box->contacts().size(), mesh->contacts().size()) << world << ", " << k;
      ASSERT_LE((q_box - q_mesh).norm(), 2e-12) << world << ", " << k;
      contacts += mesh->contacts().size();
    }
    EXPECT_EQ(mesh->unresolved_steps(), 0u);
  }
  EXPECT_GT(contacts, 5000u);
}

// A sheet at up to 2 m/s against a resting proxy: pushed along on either side, never passed; an open border passes by.
TEST(MovingMesh, SweepsASheetOntoARestingProxy) {
  const TriangleSoup sheet = field(7, 0.5, [](double x, double y) { return 0.01 * std::sin(9.0 * x) * y; });
  for (const double speed : {0.01, 0.5, 2.0, -2.0}) {
    for (const double turn : {0.0, 1.0}) {
      ScriptedMotion motion;
      motion.velocity_m_per_s = Vec3(0, 0, speed);
      motion.turn_rad_per_s = turn;
      const auto g = moving(mesh_of(sheet, 0.3), motion);
      const double T = 1e-3, side = speed > 0.0 ? 1.0 : -1.0;
      Vec3 q(0.05, 0.02, side * 0.1), beside(0.9, 0.0, side * 0.1);
      for (int k = 1; k <= 400; ++k) {
        g->set_time({.time_s = k * T, .period_s = T});
        q = (*g)(1e6, q, q);
        // Within the sheet's hills, that are a centimetre.
        ASSERT_GE(side * (q.z() - speed * k * T), -0.01) << "speed " << speed << ", step " << k;
        ASSERT_LE((q - Vec3(0.05, 0.02, q.z())).norm(), 0.2);
      }
      const Vec3 rests = (*g)(1e6, beside, beside);
      EXPECT_EQ(rests, beside);
    }
  }
}

// What sticks rides along, for as long as it likes.
TEST(MovingMesh, CarriesWhatSticks) {
  ScriptedMotion motion;
  motion.amplitude_m = Vec3(0.05, 0, 0.03);
  motion.frequency_Hz = 1.0;
  motion.turn_rad_per_s = 0.5;
  const auto g = moving(mesh_of(block({1, 1, 0.2}), 0.5), motion);
  const double T = 1e-3;
  Vec3 start(0.2, 0.1, 0.1);
  Vec3 q = motion.at(0.0) * start;
  for (int k = 1; k <= 20'000; ++k) {
    g->set_time({.time_s = k * T, .period_s = T});
    q = (*g)(1e6, q - Vec3(0, 0, 2e-3), q);
    // The lift, and rounding that goes to and fro.
    ASSERT_LE((q - motion.at(k * T) * start).norm(), 1e-11) << k;
  }
}

// Where it stands still for a while, stick is bit for bit.
TEST(MovingMesh, SticksBitForBitWhileItRests) {
  auto obstacle = std::make_unique<MovingObstacle>(mesh_of(block({1, 1, 0.2}), 0.5), Pose::Identity());
  MovingObstacle& driven = *obstacle;
  std::vector<World::Entry> entries;
  entries.push_back({std::move(obstacle), 0, -1});
  World g(std::move(entries));
  Pose X = Pose::Identity();
  Vec3 q(0.1, 0.2, 0.11);
  for (int k = 0; k < 100; ++k) {
    X.rotate(Eigen::AngleAxisd(0.01, Vec3(0, 0, 1)));
    X.translation() += Vec3(0, 1e-3, 1e-3);
    driven.drive(X);
    q = g(1e6, q - Vec3(0, 0, 1e-4), q);
  }
  driven.drive(X);
  q = g(1e6, q - Vec3(0, 0, 1e-4), q);
  for (int k = 0; k < 100; ++k) {
    driven.drive(X);
    const Vec3 r = g(1e6, q + Vec3(1e-5, 0, -1e-4), q);
    ASSERT_EQ(r, q);
  }
}

// A user's rotation that is one to six digits only must not let a proxy through.
TEST(MovingMesh, TakesRotationsInRoundNumbers) {
  auto obstacle = std::make_unique<MovingObstacle>(mesh_of(ball(2, 0.3), 0.3), Pose::Identity());
  MovingObstacle& driven = *obstacle;
  std::vector<World::Entry> entries;
  entries.push_back({std::move(obstacle), 0, -1});
  World g(std::move(entries));
  Vec3 q = Vec3::Zero();
  for (int k = 1; k <= 5000; ++k) {
    Pose X = Pose::Identity();
    const double angle = 3e-3 * k;
    X.linear() << std::round(1e6 * std::cos(angle)) / 1e6, -std::round(1e6 * std::sin(angle)) / 1e6, 0,
        std::round(1e6 * std::sin(angle)) / 1e6, std::round(1e6 * std::cos(angle)) / 1e6, 0, 0, 0, 1;
    X.translation() = Vec3(1e-3 * k, 0, 0);
    driven.drive(X);
    q = g(1e6, q + Vec3(0, 1e-4, -1e-5), q);
    ASSERT_LE((q - X.translation()).norm(), 0.3) << k;
  }
}

// Between a mesh that comes and a wall the proxy slides out, or is squeezed, which is told.
TEST(MovingMesh, ActsTogetherWithAWall) {
  for (const double mu : {0.0, 0.2}) {
    ScriptedMotion motion;
    motion.velocity_m_per_s = Vec3(-0.5, 0, 0);
    std::vector<World::Entry> entries;
    TriangleSoup wedge = block({0.4, 0.4, 0.4});
    for (Vec3& x : wedge.vertices) x += Vec3(0.5, 0, 0);
    entries.push_back({std::make_unique<MovingObstacle>(mesh_of(wedge, mu), motion), 0, -1});
    entries.push_back({std::make_unique<PlaneObstacle>(Vec3::Zero(), Vec3(0.3, 1, 0), mu), 1, -1});
    World g(std::move(entries));
    const double T = 1e-3;
    Vec3 q(0.1, -0.029, 0);
    bool both = false;
    for (int k = 1; k <= 500; ++k) {
      g.set_time({.time_s = k * T, .period_s = T});
      q = g(1e6, q - Vec3(0, 1e-5, 0), q);
      ASSERT_GE(Vec3(0.3, 1, 0).normalized().dot(q), -1e-12) << k;
      ASSERT_LE(q.x(), 0.3 - 0.5 * k * T + 1e-12) << k;
      both = both || g.contacts().size() == 2;
    }
    EXPECT_TRUE(both);
    EXPECT_EQ(g.unresolved_steps(), 0u);
    EXPECT_FALSE(g.squeezed());
  }
}

TEST(Contract, MovingMesh) {
  ScriptedMotion motion;
  motion.amplitude_m = Vec3(0.1, 0.2, 0.3);
  motion.frequency_Hz = 1.0;
  motion.phase_rad = 1.0;
  motion.axis = Vec3(1, 2, 3).normalized();
  motion.turn_rad_per_s = 2.0;
  ContractOptions<3> options{.states = 5000,
                             .centre = motion.at(0.3) * Vec3(0, 0, 0),
                             .size_m = 0.01,
                             .smallest_depth_m = 1e-7,
                             .kappa_decades = 2.0};
  options.friction = {0.3};
  options.near_surface = true;
  options.reach_m = 0.01;
  options.several = 0.01;
  options.scene_m = 1.0;
  const auto g = moving(mesh_of(ball(3, 0.4), 0.3), motion);
  g->set_time({.time_s = 0.3, .period_s = 0.0});
  expect_contract<3>(std::move(*g), options);
}

TEST(MovingMesh, AllocatesNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  ScriptedMotion motion;
  motion.velocity_m_per_s = Vec3(1, 0, 0);
  motion.turn_rad_per_s = 1.0;
  const auto g = moving(mesh_of(ball(3, 0.4), 0.3), motion);
  Random random(822);
  Vec3 q = Vec3::Zero();
  std::size_t contacts = 0;
  const std::uint64_t before = allocation_count();
  for (int k = 1; k <= 5000; ++k) {
    g->set_time({.time_s = 1e-3 * k, .period_s = 1e-3});
    q = (*g)(1e6, q + 1e-4 * random.direction<3>(), q);
    contacts += g->contacts().size();
  }
  EXPECT_EQ(allocation_count() - before, 0u);
  EXPECT_GT(contacts, 1000u);
}

// Order 2's q̃ behind a mesh that may move but rests now: others in the world were told q̃ itself, which the mesh then
// seemed to have let through, and friction was judged from there.
TEST(MovingMesh, CarriesToItsOwnSideAtRest) {
  const auto sheet = std::make_shared<const models::TriangleMesh>(field(2, 1.0, [](double, double) { return 0.0; }));
  models::MovingObstacle mesh(std::make_unique<models::MeshObstacle>(sheet, 0.3), models::ScriptedMotion{});
  const Vec3 q(0.1, 0.2, 1e-3), behind(0.1, 0.2, -1e-3), ahead(0.1, 0.2, 2e-3);
  for (int k = 1; k <= 3; ++k) {
    mesh.set_time(1e-3 * k, 1e-3);
    EXPECT_EQ(mesh.carry(q), q);
    mesh.set_time(1e-3 * k, 2e-3 / 3.0);
    EXPECT_GT(mesh.carry(behind).z(), 0.0);
    EXPECT_EQ(mesh.carry(ahead), ahead);
  }
}

}  // namespace
}  // namespace proxarm::tests
