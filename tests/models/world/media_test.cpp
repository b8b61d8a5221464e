// Viscous and Coulomb media over other 𝒢s.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "models/obstacles/round_obstacle.hpp"
#include "models/surfaces/coulomb_field.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/world/media.hpp"
#include "tests/models/world/worlds.hpp"

namespace proxarm::tests {
namespace {

using namespace models;  // NOLINT: the whole folder is under test

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

}  // namespace
}  // namespace proxarm::tests
