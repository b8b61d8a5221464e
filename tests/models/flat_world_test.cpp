// Equations (2), (3) and (4), their ℳ of (14), (16) and (17), and what rounding may not do to them.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "models/coulomb_field.hpp"
#include "models/free_space.hpp"
#include "models/friction_plane.hpp"
#include "models/mechanistic_map.hpp"
#include "models/plane.hpp"
#include "tests/models/contract.hpp"

namespace proxarm::tests {
namespace {

using models::CoulombField;
using models::FlatSurface;
using models::FreeSpace;
using models::FrictionPlane;
using models::Plane;
using models::Vec;
using models::Vec3;

constexpr double eps = std::numeric_limits<double>::epsilon();

TEST(FreeSpace, LetsTheProxyGo) {
  FreeSpace<3> g;
  const Vec3 p(0.1, 0.2, 0.3);
  EXPECT_EQ(g(1.0, p, Vec3::Zero()), p);
  EXPECT_TRUE(g.contacts().empty());
}

TEST(Contract, FreeSpace) { expect_contract<3>(FreeSpace<3>(), {.friction = {0.0}}); }

TEST(Contract, Plane) {
  expect_contract<1>(Plane<1>(Vec<1>(0.25), Vec<1>(-1.0)), {.friction = {0.0}});
  expect_contract<2>(Plane<2>({0.1, -0.2}, {1.0, 2.0}), {.friction = {0.0}});
  expect_contract<3>(Plane<3>({0.1, -0.2, 0.3}, {1.0, 2.0, -0.5}), {.friction = {0.0}});
}

TEST(Contract, FrictionPlane) {
  expect_contract<1>(FrictionPlane<1>(Vec<1>(0.25), Vec<1>(-1.0), 0.3), {.friction = {0.3}});
  expect_contract<2>(FrictionPlane<2>({0.1, -0.2}, {1.0, 2.0}, 0.3), {.friction = {0.3}});
  for (const double mu : {1e-6, 0.1, 0.3, 1.0, 5.0}) {
    expect_contract<3>(FrictionPlane<3>({0.1, -0.2, 0.3}, {1.0, 2.0, -0.5}, mu), {.friction = {mu}});
  }
}

TEST(Contract, CoulombField) {
  expect_contract<1>(CoulombField<1>(2.0), {.forces_without_contact = true});
  expect_contract<2>(CoulombField<2>(2.0), {.forces_without_contact = true});
  expect_contract<3>(CoulombField<3>(2.0), {.forces_without_contact = true});
}

// A kilometre from the origin a coordinate is a multiple of 1.1e-13 m: the contract holds with the allowance scaled by
// that, and the proxy stays within 1e-12 m of the surface.
TEST(Contract, FrictionPlaneFarFromTheOrigin) {
  const Vec3 far(1000.0, -1000.0, 500.0);
  expect_contract<3>(FrictionPlane<3>(far, {1.0, 2.0, -0.5}, 0.3), {.centre = far, .friction = {0.3}});
}

// (14), (16), (17) through map (12), and back through map (9) at states that ℳ itself gives.
template <int N, typename Law>
void expect_maps(models::GeometricAlgorithm<N>&& g, const Law& law, std::uint64_t seed) {
  Random random(seed);
  const double T = 1e-3;
  for (std::int64_t i = 0; i < scaled(50'000); ++i) {
    const double K = random.log_uniform(1.0, 1e6);
    const Vec<N> q = g(K, random.in_box<N>(1.0), random.in_box<N>(1.0));
    const Vec<N> p = q + random.log_uniform(1e-8, 1.0) * random.direction<N>();
    const models::MembershipError error = models::map_12_error<N>(g, law, K, p, q, T);
    ASSERT_LE(error.position_m, 1e-12);
    // f = K (r − p) carries K times the rounding of coordinates of about 3 m; the direction of a slip of length s
    // carries that rounding over s, times μ f: bounded by the worst of both over the states that slip.
    const Vec<N> r = g(K, p, q);
    const double f = K * (r - p).norm(), slip = (r - q).norm();
    const double tolerance = 64 * eps * (3.0 * K + f + (slip > 0.0 ? f * 3.0 / slip : 0.0));
    ASSERT_LE(error.force_N, tolerance) << state_text<N>(K, p, q, r);

    const Vec<N> f_r = K * (r - p);
    for (const double kappa : {K * 1e-6, K * 1e-3, K, K * 1e3, K * 1e6}) {
      const double kappas[] = {kappa};
      ASSERT_LE(models::map_9_error<N>(g, r, q, f_r, kappas), models::map_9_rounding<N>(r, q, f_r, K, kappa));
    }
  }
}

TEST(MechanisticMap, WallIs14) {
  const FlatSurface<3> surface({0.1, -0.2, 0.3}, {1.0, 2.0, -0.5});
  expect_maps<3>(Plane<3>(surface.point(), surface.normal()), models::WallLaw<3>(surface), 14);
  const FlatSurface<1> point(Vec<1>(0.1), Vec<1>(1.0));
  expect_maps<1>(Plane<1>(point.point(), point.normal()), models::WallLaw<1>(point), 141);
}

TEST(MechanisticMap, CoulombFieldIs16) {
  expect_maps<3>(CoulombField<3>(2.0), models::CoulombLaw<3>(2.0), 16);
  expect_maps<1>(CoulombField<1>(2.0), models::CoulombLaw<1>(2.0), 161);
}

TEST(MechanisticMap, FrictionWallIs17) {
  // On arrival the projection of q onto the surface is a rounded one: a speed of 1e-15 m over T is rest.
  const models::MembershipTolerance zero{.motion_m_per_s = 2e-15 / 1e-3};
  const FlatSurface<3> surface({0.1, -0.2, 0.3}, {1.0, 2.0, -0.5});
  expect_maps<3>(FrictionPlane<3>(surface.point(), surface.normal(), 0.3),
                 models::FrictionWallLaw<3>(surface, 0.3, zero), 17);
  const FlatSurface<2> line({0.1, -0.2}, {1.0, 2.0});
  expect_maps<2>(FrictionPlane<2>(line.point(), line.normal(), 0.3), models::FrictionWallLaw<2>(line, 0.3, zero), 172);
}

// An ℳ that refuses nothing tests nothing.
TEST(MechanisticMap, LawsRefuseWhatTheyMust) {
  const FlatSurface<3> surface(Vec3::Zero(), Vec3::UnitZ());
  const models::WallLaw<3> wall(surface);
  EXPECT_EQ(wall({0, 0, 1}, Vec3::Zero(), {0, 0, 1}).force_N, 1.0);      // a force in free space
  EXPECT_EQ(wall(Vec3::Zero(), Vec3::Zero(), {0, 0, -1}).force_N, 1.0);  // a pull
  EXPECT_EQ(wall(Vec3::Zero(), Vec3::Zero(), {1, 0, 1}).force_N, 1.0);   // friction on a smooth wall
  EXPECT_EQ(wall({0, 0, -1}, Vec3::Zero(), {0, 0, 1}).position_m, 1.0);
  const models::FrictionWallLaw<3> friction(surface, 0.5);
  EXPECT_EQ(friction(Vec3::Zero(), Vec3::Zero(), {1, 0, 1}).force_N, 0.5);
  EXPECT_EQ(friction(Vec3::Zero(), {1, 0, 0}, {0.5, 0, 1}).force_N, 1.0);  // friction that drives
  EXPECT_EQ(friction(Vec3::Zero(), {1, 0, 0}, {-0.5, 0, 1}).force_N, 0.0);
  const models::CoulombLaw<3> field(2.0);
  EXPECT_EQ(field(Vec3::Zero(), Vec3::Zero(), {3, 0, 0}).force_N, 1.0);
  EXPECT_EQ(field(Vec3::Zero(), {1, 0, 0}, {-1, 0, 0}).force_N, 1.0);
  EXPECT_EQ(field(Vec3::Zero(), {1, 0, 0}, {-2, 0, 0}).force_N, 0.0);
}

TEST(Plane, IsEquation2) {
  Plane<3> g(Vec3::Zero(), Vec3::UnitZ());
  EXPECT_EQ(g(1.0, {1, 2, 3}, Vec3::Zero()), Vec3(1, 2, 3));
  EXPECT_TRUE(g.contacts().empty());
  EXPECT_EQ(g(1.0, {1, 2, -3}, Vec3::Zero()), Vec3(1, 2, 0));
  ASSERT_EQ(g.contacts().size(), 1u);
  EXPECT_EQ(g.contacts()[0].normal, Vec3(Vec3::UnitZ()));
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

TEST(CoulombField, IsEquation3) {
  CoulombField<3> g(2.0);
  EXPECT_EQ(g(1.0, {2, 0, 0}, Vec3::Zero()), Vec3::Zero());
  EXPECT_EQ(g(1.0, {3, 0, 0}, Vec3::Zero()), Vec3(1, 0, 0));
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

TEST(FlatWorld, HoldsAtTheEdgesOfDoubles) {
  FrictionPlane<3> g(Vec3::Zero(), Vec3::UnitZ(), 0.3);
  CoulombField<3> field(1.0);
  const double tiny = std::numeric_limits<double>::denorm_min();
  for (const double K : {1e-12, 1.0, 1e12}) {
    for (const double x : {0.0, tiny, 1e-300, 1e-160, 1e-9, 1.0, 1e9}) {
      for (const double z : {0.0, -0.0, tiny, -tiny, -1e-300, -1e-160, -1e-9, -1.0, -1e9}) {
        EXPECT_TRUE(g(K, {x, 0, z}, Vec3::Zero()).allFinite());
        EXPECT_TRUE(field(K, {x, 0, z}, Vec3::Zero()).allFinite());
      }
    }
  }
  EXPECT_EQ(field(1.0, Vec3::Zero(), Vec3::Zero()), Vec3::Zero());
  EXPECT_EQ(g(1.0, Vec3::Zero(), Vec3::Zero()), Vec3::Zero());
}

TEST(FlatWorld, RefusesWhatHasNoMeaning) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Plane<3>(Vec3::Zero(), Vec3::Zero()), std::invalid_argument);
  EXPECT_THROW(Plane<3>(Vec3::Zero(), Vec3(nan, 0, 1)), std::invalid_argument);
  EXPECT_THROW(Plane<3>(Vec3(0, inf, 0), Vec3::UnitX()), std::invalid_argument);
  EXPECT_THROW(FrictionPlane<3>(Vec3::Zero(), Vec3::UnitX(), -0.1), std::invalid_argument);
  EXPECT_THROW(FrictionPlane<3>(Vec3::Zero(), Vec3::UnitX(), nan), std::invalid_argument);
  EXPECT_THROW(CoulombField<3>(0.0), std::invalid_argument);
  EXPECT_THROW(CoulombField<3>{inf}, std::invalid_argument);
  EXPECT_NO_THROW(Plane<3>(Vec3::Zero(), Vec3(1e-300, 1e-300, 0)));  // small, but with a direction
  EXPECT_NO_THROW(Plane<3>(Vec3::Zero(), Vec3(1e300, 1e300, 0)));
}

TEST(ForceCones, SumHoldsWhatItsMembersBear) {
  Random random(404);
  for (std::int64_t i = 0; i < scaled(50'000); ++i) {
    models::ForceCone cones[3];
    const auto count = static_cast<std::size_t>(1 + random.below(3));
    Vec3 f = Vec3::Zero();
    for (std::size_t c = 0; c < count; ++c) {
      cones[c] = {random.direction<3>(), random.chance(0.3) ? 0.0 : random.uniform(0.0, 1.0)};
      const double f_n = random.chance(0.3) ? 0.0 : random.uniform(0.0, 10.0);
      const Vec3 t = cones[c].axis.cross(random.direction<3>());
      f += f_n * (cones[c].axis + random.uniform(0.0, 1.0) * cones[c].mu * t);
    }
    ASSERT_TRUE(models::in_sum_of_cones(f, {cones, count}, 1e-12));
    // A direction that no member of the dual is against: what the least y finds must be a separating plane.
    const Vec3 g = 10.0 * random.direction<3>();
    if (!models::in_sum_of_cones(g, {cones, count}, 1e-9)) {
      ASSERT_FALSE(models::in_sum_of_cones(2.0 * g, {cones, count}, 1e-9));
      const Vec3 sum = g + f;  // f bears something: g + f may be in, but g alone may not be reached from below
      ASSERT_FALSE(models::in_sum_of_cones(Vec3(sum - f), {cones, count}, 1e-9));
    }
  }
}

}  // namespace
}  // namespace proxarm::tests
