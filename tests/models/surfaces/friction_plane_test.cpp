// Equation (4), a wall with friction, and what rounding may not do to it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "models/surfaces/friction_plane.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {
namespace {

using models::FlatSurface;
using models::FrictionPlane;
using models::Vec;
using models::Vec3;

constexpr double eps = std::numeric_limits<double>::epsilon();

TEST(Contract, FrictionPlane) {
  expect_contract<1>(FrictionPlane<1>(Vec<1>(0.25), Vec<1>(-1.0), 0.3), {.friction = {0.3}});
  expect_contract<2>(FrictionPlane<2>({0.1, -0.2}, {1.0, 2.0}, 0.3), {.friction = {0.3}});
  for (const double mu : {1e-6, 0.1, 0.3, 1.0, 5.0}) {
    expect_contract<3>(FrictionPlane<3>({0.1, -0.2, 0.3}, {1.0, 2.0, -0.5}, mu), {.friction = {mu}});
  }
}

// A kilometre from the origin a coordinate is a multiple of 1.1e-13 m: the contract holds with the allowance scaled by
// that, and the proxy stays within 1e-12 m of the surface.
TEST(Contract, FrictionPlaneFarFromTheOrigin) {
  const Vec3 far(1000.0, -1000.0, 500.0);
  expect_contract<3>(FrictionPlane<3>(far, {1.0, 2.0, -0.5}, 0.3), {.centre = far, .friction = {0.3}});
}

TEST(FrictionPlane, IsEquation4) {
  FrictionPlane<3> g(Vec3::Zero(), Vec3::UnitZ(), 0.5);
  EXPECT_EQ(g(1.0, {1, 2, 3}, Vec3::Zero()), Vec3(1, 2, 3));
  EXPECT_EQ(g(1.0, {1, 0, -2}, Vec3::Zero()), Vec3::Zero());  // ‖p_sf − q_sf‖ = 1 = μ·2: sticks
  EXPECT_FALSE(g.contacts()[0].slips);
  EXPECT_EQ(g(1.0, {3, 0, -2}, Vec3::Zero()), Vec3(2, 0, 0));  // 3 − μ·2
  EXPECT_TRUE(g.contacts()[0].slips);
  EXPECT_EQ(g(1.0, {1, 0, -2}, {0, 0, 5}), Vec3::Zero());  // arrives and sticks below q
}

// At 1 kg and 1 kHz, 5 N is 5 µm of penetration and 1 µm of error is 1 N; a finger proxy with an epsilon never leaves.
TEST(FrictionPlane, SlidesFromRestAtOneMillinewtonOverTheCone) {
  Random random(401);
  const double K = 1e6;  // M/T²
  for (std::int64_t i = 0; i < scaled(20'000); ++i) {
    const Vec3 n = random.direction<3>(), origin = random.in_box<3>(1.0);
    FrictionPlane<3> g(origin, n, 0.3);
    const FlatSurface<3> surface(origin, n);
    const Vec3 q = surface.projection(surface.projection(random.in_box<3>(1.0)));
    const Vec3 t = n.cross(random.direction<3>()).normalized();
    const double push = random.log_uniform(0.1, 100.0);
    const Vec3 inside = q - push / K * n + (0.3 * push - 1e-3) / K * t;
    ASSERT_EQ(g(K, inside, q), q) << "must stick";
    const Vec3 outside = q - push / K * n + (0.3 * push + 1e-3) / K * t;
    const Vec3 r = g(K, outside, q);
    // It moves by 1 mN / K = 1 nm, along t.
    ASSERT_NEAR((r - q).dot(t), 1e-3 / K, 1e-14) << "must slide";
  }
}

TEST(FrictionPlane, SticksBitForBitForAnyNumberOfCycles) {
  Random random(402);
  for (std::int64_t i = 0; i < scaled(200); ++i) {
    const Vec3 n = random.direction<3>(), origin = random.in_box<3>(random.log_uniform(1e-3, 1e3));
    FrictionPlane<3> g(origin, n, 0.3);
    Vec3 q = origin + random.in_box<3>(1.0);
    q = g(1e6, q - 3.0 * n, q);  // somewhere on the surface
    const Vec3 start = q;
    for (int k = 0; k < 1000; ++k) {
      const double push = random.uniform(0.01, 50.0);
      const Vec3 side = random.uniform(0.0, 0.299 * push) * n.cross(random.direction<3>()).normalized();
      // Far from the origin p is rounded by more than the push is deep: the cone has to be kept with that.
      if (0.001 * push / 1e6 < 4.0 * eps * (q.norm() + 1.0)) continue;
      q = g(1e6, q + (side - push * n) / 1e6, q);
    }
    ASSERT_EQ(q, start);
  }
}

TEST(FrictionPlane, KeepsTheProxyOnTheSurfaceOverAMillionSteps) {
  Random random(403);
  const Vec3 n = random.direction<3>(), origin(0.3, 0.5, -0.4);
  FrictionPlane<3> g(origin, n, 0.3);
  const FlatSurface<3> surface(origin, n);
  Vec3 q = g(1e6, origin - n, origin);
  double worst = 0.0;
  for (std::int64_t i = 0; i < scaled(1e6); ++i) {
    const Vec3 centre = 0.5 * (origin - q);  // keep it within a metre
    q = g(1e6, q - random.log_uniform(1e-9, 1e-2) * n + 1e-2 * (random.direction<3>() + centre), q);
    worst = std::max(worst, std::max(0.0, -surface.height(q)));
  }
  EXPECT_LE(worst, 1e-12);
  std::cout << "  deepest " << worst << " m\n";
}

// Coordinates and stiffnesses from the least to the largest that doubles hold give finite results.
TEST(FrictionPlane, HoldsAtTheEdgesOfDoubles) {
  FrictionPlane<3> g(Vec3::Zero(), Vec3::UnitZ(), 0.3);
  const double tiny = std::numeric_limits<double>::denorm_min();
  for (const double K : {1e-12, 1.0, 1e12}) {
    for (const double x : {0.0, tiny, 1e-300, 1e-160, 1e-9, 1.0, 1e9}) {
      for (const double z : {0.0, -0.0, tiny, -tiny, -1e-300, -1e-160, -1e-9, -1.0, -1e9}) {
        EXPECT_TRUE(g(K, {x, 0, z}, Vec3::Zero()).allFinite());
      }
    }
  }
  EXPECT_EQ(g(1.0, Vec3::Zero(), Vec3::Zero()), Vec3::Zero());
}

TEST(FrictionPlane, RefusesWhatHasNoMeaning) {
  EXPECT_THROW(FrictionPlane<3>(Vec3::Zero(), Vec3::UnitX(), -0.1), std::invalid_argument);
  EXPECT_THROW(FrictionPlane<3>(Vec3::Zero(), Vec3::UnitX(), std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
}

}  // namespace
}  // namespace proxarm::tests
