// ℳ of (14), (16) and (17): each 𝒢 obeys its own by the maps (9) and (12).
#include <gtest/gtest.h>

#include <limits>

#include "models/surfaces/coulomb_field.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/mechanistic_map.hpp"
#include "models/surfaces/plane.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {
namespace {

using models::CoulombField;
using models::FlatSurface;
using models::FrictionPlane;
using models::Plane;
using models::Vec;
using models::Vec3;

constexpr double eps = std::numeric_limits<double>::epsilon();

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

}  // namespace
}  // namespace proxarm::tests
