// Moving objects, media and guides.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "models/box_obstacle.hpp"
#include "models/coulomb_field.hpp"
#include "models/free_space.hpp"
#include "models/friction_plane.hpp"
#include "models/guides.hpp"
#include "models/media.hpp"
#include "models/moving_obstacle.hpp"
#include "models/plane_obstacle.hpp"
#include "models/round_obstacle.hpp"
#include "models/world.hpp"
#include "tests/models/contract.hpp"

namespace proxarm::tests {
namespace {

using namespace models;  // NOLINT: the whole folder is under test

std::unique_ptr<World> single(std::unique_ptr<Obstacle> obstacle) {
  std::vector<World::Entry> entries;
  entries.push_back({std::move(obstacle), 0, -1});
  return std::make_unique<World>(std::move(entries));
}

template <int N>
Media<N> media(std::unique_ptr<GeometricAlgorithm<N>> rest, double damping, double force,
               std::unique_ptr<Obstacle> shape = nullptr) {
  std::vector<Medium> all;
  all.push_back({damping, force, std::move(shape)});
  return Media<N>(std::move(rest), std::move(all));
}

TEST(Media, ViscousIsALinearMix) {
  auto g = media<3>(std::make_unique<FreeSpace<3>>(), 20.0, 0.0);
  g.set_time({.time_s = 0.0, .period_s = 2e-3});
  // q(k) = (K p + (b/T) q)/(K + b/T), b/T = 10⁴ N/m.
  EXPECT_LE((g(3e4, {1, 2, 3}, {0, 0, 0}) - 0.75 * Vec3(1, 2, 3)).norm(), 1e-15);
}

TEST(Media, CoulombOverFreeSpaceIsEquation3) {
  Random random(701);
  auto g = media<3>(std::make_unique<FreeSpace<3>>(), 0.0, 2.0);
  CoulombField<3> exact(2.0);
  for (std::int64_t i = 0; i < scaled(20'000); ++i) {
    const Vec3 q = random.in_box<3>(1.0), p = q + random.log_uniform(1e-9, 1.0) * random.direction<3>();
    const double K = random.log_uniform(1.0, 1e6);
    ASSERT_LE((g(K, p, q) - exact(K, p, q)).norm(), 1e-14);
  }
}

// On a plane the field adds to friction: (4) with F/K more.
TEST(Media, CoulombOverAWallAddsToItsFriction) {
  Random random(702);
  auto g = media<3>(std::make_unique<FrictionPlane<3>>(Vec3::Zero(), Vec3::UnitZ(), 0.3), 0.0, 2.0);
  for (std::int64_t i = 0; i < scaled(20'000); ++i) {
    const double K = 1e4, push = random.uniform(0.1, 20.0), pull = random.uniform(0.1, 20.0);
    const Vec3 q(random.uniform(-1, 1), random.uniform(-1, 1), 0.0);
    const double moved = std::max(0.0, pull - 0.3 * push - 2.0) / K;
    const Vec3 r = g(K, q + Vec3(pull, 0, -push) / K, q);
    ASSERT_LE((r - q - Vec3(moved, 0, 0)).norm(), 1e-13) << push << " " << pull;
    if (moved == 0.0) {
      ASSERT_EQ(r, q);
    }
  }
}

// A soft coupling looks far behind a wall that the proxy, which all but rests before it, doesn't reach.
TEST(Media, CoulombBeforeAWallIsEquation3AtEveryStiffness) {
  auto g = media<3>(std::make_unique<FrictionPlane<3>>(Vec3(0.9, 0, 0), -Vec3::UnitX(), 0.3), 0.0, 1.0);
  const Vec3 q(0.899943, -0.19446, 1.1062), direction = Vec3(6.1, 1.2, 7.1).normalized();
  const Vec3 r = q + 3.8e-6 * direction;
  for (double K = 1e-2; K < 1e9; K *= 7.0) {
    ASSERT_LE((g(K, r + direction / K, q) - r).norm(), 1e-15 * (4.0 + 2.0 / K)) << K;
  }
}

// Contact, if any, with a ball without friction: f is within F of its cone; and without contact it is F.
void expect_law_at_a_ball(GeometricAlgorithm<3>& g, double K, double F, const Vec3& p, const Vec3& q,
                          std::int64_t& unresolved) {
  const std::uint64_t before = g.unresolved_steps();
  const Vec3 r = g(K, p, q), f = K * (r - p);
  ASSERT_TRUE(r.allFinite());
  if (g.unresolved_steps() != before) {
    ++unresolved;
    return;
  }
  const double moved = (r - q).norm(), size = r.norm() + p.norm() + q.norm();
  // How far r moved is known to some units of its coordinates, and f to the same times K.
  double tolerance = 256.0 * 2.2e-16 * K * size + F * 1e-9;
  // Whether it rests is seen where the ball looks flat: from as near as a millionth of the way, deep in one.
  tolerance += F * std::min(16.0 * 2.2e-16 * size / (moved > 0.0 ? moved : 1e-6 * F / K), 1e-3);
  if (g.contacts().empty()) {
    ASSERT_LE(f.norm(), F + tolerance) << q.transpose() << " to " << p.transpose();
    if (moved > 0.0) {
      ASSERT_GE(f.norm(), F - tolerance) << q.transpose() << " to " << p.transpose();
    }
  } else {
    const Vec3& n = g.contacts()[0].normal;
    ASSERT_GE(n.dot(f), -F - tolerance);
    // The normal turns by rounding over the radius.
    const double turned = f.norm() * 64.0 * 2.2e-16 * size / 0.01;
    ASSERT_LE((f - n * n.dot(f)).norm() - F, tolerance + turned) << "F " << F << " moved " << moved;
  }
}

// A push straight through a ball's middle has two answers, before it and past it, and rounding chooses anew for each
// point of the way that the medium's force is sought on.
TEST(Media, CoulombFindsItsForcePastTheMiddleOfABall) {
  Random random(703);
  std::int64_t unresolved = 0;
  const std::int64_t states = scaled(100'000);
  for (std::int64_t i = 0; i < states; ++i) {
    const double radius = random.log_uniform(0.01, 0.3), F = random.log_uniform(1e-3, 100.0);
    const Vec3 c = random.in_box<3>(0.5), along = random.direction<3>();
    auto g = media<3>(single(std::make_unique<Sphere>(PointCore{c}, radius, 0.0, false)), 0.0, F);
    const Vec3 q = c - radius * (1.0 + random.log_uniform(1e-6, 30.0)) * along;
    const Vec3 p = c + radius * (1.0 + random.log_uniform(1e-6, 300.0)) * along;
    const double K = F * random.log_uniform(1.01, 1e6) / (p - q).norm();
    ASSERT_NO_FATAL_FAILURE(expect_law_at_a_ball(g, K, F, p, q, unresolved)) << "state " << i;
  }
  EXPECT_LE(unresolved, states / 100);
}

// All but at rest on a ball: the way left is a part in 1e9 to 1e-2 of that without the medium, and a hundredth of the
// latter is bent already.
TEST(Media, CoulombLetsSlipOnABallAsLittleAsItsForceAllows) {
  Random random(704);
  std::int64_t unresolved = 0;
  for (std::int64_t i = 0; i < scaled(100'000); ++i) {
    const double radius = random.log_uniform(0.01, 0.3), F = random.log_uniform(0.1, 10.0);
    const double K = random.log_uniform(1e4, 1e6), push = random.log_uniform(0.1, 1e3);
    const Vec3 c = random.in_box<3>(0.5), n = random.direction<3>(), t = n.cross(random.direction<3>()).normalized();
    auto g = media<3>(single(std::make_unique<Sphere>(PointCore{c}, radius, 0.0, false)), 0.0, F);
    const Vec3 q = c + radius * n;
    const double pull = F * (1.0 + (random.chance(0.3) ? -1.0 : 1.0) * random.log_uniform(1e-9, 1e-2));
    ASSERT_NO_FATAL_FAILURE(expect_law_at_a_ball(g, K, F, q + (pull * t - push * n) / K, q, unresolved))
        << "state " << i << " pull/F " << pull / F << " push " << push << " K " << K;
  }
  EXPECT_EQ(unresolved, 0);
}

TEST(Contract, Media) {
  ContractOptions<3> options;
  options.forces_without_contact = true;
  expect_contract<3>(media<3>(std::make_unique<FreeSpace<3>>(), 20.0, 0.0), options);
  expect_contract<3>(media<3>(std::make_unique<FreeSpace<3>>(), 20.0, 3.0), options);
  expect_contract<3>(media<3>(std::make_unique<FrictionPlane<3>>(Vec3(0.1, 0, 0), Vec3(1, 2, 3), 0.3), 20.0, 0.0),
                     options);
  options.condition = 100.0;  // a root over a root
  expect_contract<3>(media<3>(std::make_unique<FrictionPlane<3>>(Vec3(0.1, 0, 0), Vec3(1, 2, 3), 0.3), 20.0, 3.0),
                     options);
  expect_contract<2>(media<2>(std::make_unique<FreeSpace<2>>(), 20.0, 3.0), {.forces_without_contact = true});
}

TEST(Media, ActWithinTheirShapeOnly) {
  auto g = media<3>(std::make_unique<FreeSpace<3>>(), 1e6, 0.0,
                    std::make_unique<Sphere>(PointCore{Vec3::Zero()}, 0.1, 0.0, false));
  EXPECT_EQ(g(1e3, {1, 0, 0}, {0.5, 0, 0}), Vec3(1, 0, 0));
  EXPECT_LT(g(1e3, {1, 0, 0}, {0.05, 0, 0}).x(), 0.06);
}

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

TEST(Guides, LineHoldsAcrossAndSlidesAlong) {
  auto g = PolylineGuide::line({0, 0, 1}, {2, 0, 0}, 0.2);
  EXPECT_EQ(g(1.0, {5, 3, 5}, {0, 0, 1}), Vec3(4, 0, 1));    // 5 across, so 1 of friction
  EXPECT_EQ(g(1.0, {0.9, 3, 5}, {0, 0, 1}), Vec3(0, 0, 1));  // holds
  EXPECT_EQ(g(1.0, {-5, 3, 5}, {0, 0, 1}), Vec3(-4, 0, 1));
}

TEST(Guides, PolylineTurnsItsCorners) {
  PolylineGuide g({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, false, 0.0);
  EXPECT_LE((g(1.0, {0.5, 3, 0}, {0.2, 0, 0}) - Vec3(0.5, 0, 0)).norm(), 1e-15);
  EXPECT_LE((g(1.0, {1.5, 0.5, 0}, {0.2, 0, 0}) - Vec3(1, 0.5, 0)).norm(), 1e-15);  // around the corner
  EXPECT_LE((g(1.0, {1.5, -0.5, 0}, {0.2, 0, 0}) - Vec3(1, 0, 0)).norm(), 1e-15);   // held in it
  EXPECT_LE((g(1.0, {1.5, 2.5, 0}, {0.2, 0, 0}) - Vec3(1, 1, 0)).norm(), 1e-15);    // the end
  EXPECT_LE((g(1.0, {-1, 0.2, 0}, {1, 0.5, 0}) - Vec3(1, 0.2, 0)).norm(), 1e-15);   // doesn't jump to the other leg
  EXPECT_LE((g(1.0, {-1, -0.2, 0}, {1, 0.5, 0}) - Vec3(0, 0, 0)).norm(), 1e-15);    // and back to the beginning
  PolylineGuide closed({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, true, 0.0);
  EXPECT_LE((closed(1.0, {0.4, 1.4, 0}, {1, 0.5, 0}) - Vec3(0.9, 0.9, 0)).norm(), 1e-15);
}

TEST(Contract, Guides) {
  ContractOptions<3> options;
  options.forces_without_contact = true;
  options.scene_m = 0.4;
  expect_contract<3>(PolylineGuide::line({0.1, 0.2, 0.3}, {1, 2, 3}, 0.3), options);
  expect_contract<3>(PlaneGuide({0.1, 0.2, 0.3}, {1, 2, 3}, 0.3), options);
}

TEST(Guides, RefuseWhatHasNoMeaning) {
  EXPECT_THROW(PolylineGuide({{0, 0, 0}}, false, 0.0), std::invalid_argument);
  EXPECT_THROW(PolylineGuide({{0, 0, 0}, {0, 0, 0}}, false, 0.0), std::invalid_argument);
  EXPECT_THROW(PolylineGuide::line({0, 0, 0}, {0, 0, 0}, 0.0), std::invalid_argument);
  EXPECT_THROW(PlaneGuide({0, 0, 0}, {0, 0, 1}, -1.0), std::invalid_argument);
}

}  // namespace
}  // namespace proxarm::tests
