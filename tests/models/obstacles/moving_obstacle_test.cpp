// Objects that move, by a script or driven.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "tests/models/world/worlds.hpp"

namespace proxarm::tests {
namespace {

using namespace models;  // NOLINT: the whole folder is under test

// A plate at up to 2 m/s against a resting proxy: it is pushed along, never passed.
TEST(MovingObstacle, SweepsAPlateOntoARestingProxy) {
  for (const double speed : {0.01, 0.5, 2.0}) {
    for (const double thickness : {1e-5, 0.01}) {
      ScriptedMotion motion;
      motion.velocity_m_per_s = Vec3(0, 0, speed);
      Pose X = Pose::Identity();
      X.translation() = Vec3(0, 0, -0.1 - 0.5 * thickness);
      auto g = single(
          std::make_unique<MovingObstacle>(std::make_unique<BoxObstacle>(X, Vec3(1.0, 1.0, thickness), 0.3), motion));
      const double T = 1e-3;
      Vec3 q(0.05, 0, 0);
      bool touched = false;
      for (int k = 1; k <= 400; ++k) {
        g->set_time({.time_s = k * T, .period_s = T});
        q = (*g)(1e6, q, q);  // no force: it stays where it is put
        const double top = -0.1 + speed * k * T;
        ASSERT_GE(q.z(), top - 1e-12) << "speed " << speed << ", step " << k;
        touched = touched || !g->contacts().empty();
      }
      EXPECT_EQ(touched, speed * 0.4 > 0.1);
      EXPECT_NEAR(q.x(), 0.05, 1e-12);
    }
  }
}

// What sticks to a moving plate rides with it.
TEST(MovingObstacle, CarriesWhatSticks) {
  ScriptedMotion motion;
  motion.amplitude_m = Vec3(0.05, 0, 0);
  motion.frequency_Hz = 1.0;
  motion.turn_rad_per_s = 0.5;
  auto g = single(
      std::make_unique<MovingObstacle>(std::make_unique<PlaneObstacle>(Vec3::Zero(), Vec3::UnitZ(), 0.5), motion));
  const double T = 1e-3;
  Vec3 q(0.2, 0.1, 0);
  const Vec3 start = q;
  for (int k = 1; k <= 1000; ++k) {
    g->set_time({.time_s = k * T, .period_s = T});
    q = (*g)(1e6, q - Vec3(0, 0, 1e-3), q);
    ASSERT_LE((q - motion.at(k * T) * start).norm(), 1e-12) << k;
  }
}

// A groove that moves sideways at up to 1 m/s against a proxy that nothing else moves.
TEST(MovingObstacle, GrooveSweepsOntoARestingProxy) {
  for (const double speed : {1e-3, 0.1, 1.0}) {
    for (const double mu : {0.0, 0.3, 1.2}) {
      ScriptedMotion motion;
      motion.velocity_m_per_s = Vec3(speed, 0, 0);
      std::vector<World::Entry> entries;
      for (const double side : {1.0, -1.0}) {
        entries.push_back({std::make_unique<MovingObstacle>(
                               std::make_unique<PlaneObstacle>(Vec3::Zero(), Vec3(side, 0.1 * side, 1), mu), motion),
                           0, -1});
      }
      World g(std::move(entries));
      const double T = 1e-3;
      Vec3 q(0, 0, 2e-4);
      for (int k = 1; k <= 500; ++k) {
        g.set_time({.time_s = k * T, .period_s = T});
        q = g(1e6, q, q);
        ASSERT_GE(q.z(), std::abs(q.x() - speed * k * T + 0.1 * q.y()) - 1e-12) << speed << ", " << mu << ", " << k;
      }
      EXPECT_GT(q.x(), 0.0);
      EXPECT_EQ(g.unresolved_steps(), 0u);
    }
  }
}

// A groove that moves sideways at up to 1 m/s holds the proxy in it.
TEST(MovingObstacle, GrooveTakesTheProxyAlong) {
  for (const double speed : {0.1, 1.0}) {
    ScriptedMotion motion;
    motion.velocity_m_per_s = Vec3(speed, 0, 0);
    std::vector<World::Entry> entries;
    for (const double side : {1.0, -1.0}) {
      entries.push_back({std::make_unique<MovingObstacle>(
                             std::make_unique<PlaneObstacle>(Vec3::Zero(), Vec3(side, 0, 1), 0.3), motion),
                         0, -1});
    }
    World g(std::move(entries));
    const double T = 1e-3;
    Vec3 q = Vec3::Zero();
    for (int k = 1; k <= 500; ++k) {
      g.set_time({.time_s = k * T, .period_s = T});
      // Pushed down hard enough to be taken along.
      q = g(1e6, q - Vec3(0, 0, 3e-3), q);
      ASSERT_GE(q.z(), std::abs(q.x() - speed * k * T) - 1e-12);
      ASSERT_LE((q - Vec3(speed * k * T, 0, 0)).norm(), 2e-3);
    }
    EXPECT_EQ(g.unresolved_steps(), 0u);
  }
}

// A press that closes on the proxy: no point keeps all laws then. It stays finite, and says so.
TEST(MovingObstacle, SqueezesTheProxyWithoutLosingIt) {
  for (const double speed : {0.01, 1.0}) {
    ScriptedMotion down;
    down.velocity_m_per_s = Vec3(0, 0, -speed);
    std::vector<World::Entry> entries;
    entries.push_back({std::make_unique<PlaneObstacle>(Vec3::Zero(), Vec3::UnitZ(), 0.3), 0, -1});
    entries.push_back(
        {std::make_unique<MovingObstacle>(std::make_unique<PlaneObstacle>(Vec3(0, 0, 0.05), -Vec3::UnitZ(), 0.3), down),
         1, -1});
    World g(std::move(entries));
    const double T = 1e-3;
    Vec3 q(0, 0, 0.02);
    for (int k = 1; k * T * speed < 0.06; ++k) {
      g.set_time({.time_s = k * T, .period_s = T});
      q = g(1e6, q - Vec3(0, 0, 5e-6), q);
      ASSERT_TRUE(q.allFinite());
      const double gap = 0.05 - speed * k * T;
      if (gap > 1e-9) {
        ASSERT_GE(q.z(), -1e-12);
        ASSERT_LE(q.z(), gap + 1e-12);
        ASSERT_EQ(g.unresolved_steps(), 0u);
        ASSERT_FALSE(g.squeezed());
      } else {
        ASSERT_LE(std::abs(q.z()), 0.02);
      }
    }
    EXPECT_GT(g.unresolved_steps(), 0u);
    EXPECT_TRUE(g.squeezed());
    g.set_time({.time_s = 0.0, .period_s = T});
    q = g(1e6, Vec3(0, 0, 0.02), Vec3(0, 0, 0.02));
    EXPECT_FALSE(g.squeezed()) << "there is room again";
  }
}

TEST(MovingObstacle, IsDrivenFromOutside) {
  auto plate = std::make_unique<MovingObstacle>(std::make_unique<PlaneObstacle>(Vec3::Zero(), Vec3::UnitZ(), 0.0),
                                                Pose::Identity());
  MovingObstacle& handle = *plate;
  auto g = single(std::move(plate));
  Vec3 q(0, 0, 0.1);
  Pose X = Pose::Identity();
  X.translation().z() = 0.25;
  handle.drive(X);
  q = (*g)(1e6, q, q);
  EXPECT_NEAR(q.z(), 0.25, 1e-15);
}

}  // namespace
}  // namespace proxarm::tests
