// Limits as sets, and the guard of what the drives are told.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/limits/limited_algorithm.hpp"
#include "controller/proxies/admittance_proxy.hpp"
#include "controller/setpoints/joint_guard.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/plane.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "tests/controller/limits/nearest_point.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using models::Vec3;
using tests::Random;

std::vector<description::DriveDescription> random_drives(Random& random, int count) {
  std::vector<description::DriveDescription> drives;
  for (int i = 0; i < count; ++i) {
    description::DriveDescription drive;
    drive.range_rad = {random.uniform(-3.0, -0.01), random.uniform(0.01, 3.0)};
    drive.max_speed_rad_per_s = random.log_uniform(0.1, 10.0);
    drive.max_acceleration_rad_per_s2 = random.log_uniform(1.0, 200.0);
    drives.push_back(drive);
  }
  return drives;
}

// Setpoints as bad as they get: jumps, ramps into the ends of the range, noise, what isn't a number.
double bad_wish(Random& random, double wish, const description::DriveDescription& drive, double T) {
  switch (random.below(200)) {
    case 0:
      return random.uniform(2.0 * drive.range_rad[0], 2.0 * drive.range_rad[1]);
    case 1:
      return random.chance(0.5) ? drive.range_rad[0] : drive.range_rad[1];
    case 2:
      return std::numeric_limits<double>::quiet_NaN();
    case 3:
      return random.chance(0.5) ? 1e300 : -1e300;
    default:
      break;
  }
  if (!std::isfinite(wish) || std::abs(wish) > 10.0) wish = 0.0;
  return wish + random.uniform(-2.0, 2.0) * drive.max_speed_rad_per_s * T;
}

// 10⁷ joint setpoints at PROXARM_TEST_SCALE=21.
TEST(JointGuard, LetsNothingBeyondRangeSpeedOrAccelerationThrough) {
  Random random(11);
  constexpr int axes = 6, cycles = 2000;
  const std::int64_t runs = tests::scaled(40);
  for (std::int64_t run = 0; run < runs; ++run) {
    const double T = random.log_uniform(2.5e-4, 4e-3);
    const auto drives = random_drives(random, axes);
    JointGuard guard(drives, T);
    JointVector theta = JointVector::Zero(axes), u_k1 = JointVector::Zero(axes), wish = theta;
    guard.start(theta);
    for (int k = 0; k < cycles; ++k) {
      for (int i = 0; i < axes; ++i) wish[i] = bad_wish(random, wish[i], drives[static_cast<std::size_t>(i)], T);
      if (random.chance(0.001)) guard.follow_from_here();
      guard.step(wish);
      for (int i = 0; i < axes; ++i) {
        const auto& drive = drives[static_cast<std::size_t>(i)];
        const double u = (guard.target_rad()[i] - theta[i]) / T;
        // Angles of up to 6 rad are rounded to 1e-15: 4e-12 rad/s in a difference at 0.25 ms, 3e-8 rad/s² in two.
        ASSERT_LE(guard.target_rad()[i], drive.range_rad[1] + 1e-12);
        ASSERT_GE(guard.target_rad()[i], drive.range_rad[0] - 1e-12);
        ASSERT_LE(std::abs(u), drive.max_speed_rad_per_s + 1e-10);
        ASSERT_LE(std::abs(u - u_k1[i]) / T, drive.max_acceleration_rad_per_s2 + 1e-7) << "run " << run << " " << k;
        u_k1[i] = u;
      }
      theta = guard.target_rad();
    }
  }
}

TEST(JointGuard, PassesWhatItMayToTheBitAndFlagsNothing) {
  std::vector<description::DriveDescription> drives(1);
  drives[0].range_rad = {-1.0, 1.0};
  drives[0].max_speed_rad_per_s = 2.0;
  drives[0].max_acceleration_rad_per_s2 = 30.0;
  JointGuard guard(drives, 1e-3);
  guard.start(JointVector::Zero(1));
  for (int k = 0; k < 3000; ++k) {
    const JointVector wish = JointVector::Constant(1, 0.3 * (1.0 - std::cos(3e-3 * k)));
    const ActiveLimits active = guard.step(wish);
    ASSERT_EQ(active.kinds, 0);
    ASSERT_EQ(guard.target_rad()[0], wish[0]);
  }
}

TEST(JointGuard, CatchesUpWithAJumpWithoutOvershoot) {
  std::vector<description::DriveDescription> drives(1);
  drives[0].range_rad = {-1.0, 1.0};
  drives[0].max_speed_rad_per_s = 2.0;
  drives[0].max_acceleration_rad_per_s2 = 30.0;
  JointGuard guard(drives, 1e-3);
  guard.start(JointVector::Zero(1));
  double highest = 0.0;
  for (int k = 0; k < 600; ++k) {
    guard.step(JointVector::Constant(1, 0.5));
    highest = std::max(highest, guard.target_rad()[0]);
  }
  EXPECT_NEAR(guard.target_rad()[0], 0.5, 1e-9);
  EXPECT_LE(highest, 0.5 + 0.5 * 30.0 * 1e-6);  // a step at most
}

// A wall, frictionless or not, with random limits around the proxy. The scale is that of a cycle: some 0.1 mm.
struct RandomStep {
  Vec3 point = Vec3::Zero(), normal = Vec3::UnitX();
  double friction = 0.0;
  StepLimits limits;
  Vec3 p = Vec3::Zero(), q = Vec3::Zero();
  double K = 0.0;
};

RandomStep random_step(Random& random, double friction) {
  RandomStep step;
  step.normal = random.direction<3>();
  step.point = random.in_box<3>(1e-4);
  step.friction = friction;
  step.q = step.point + random.in_box<3>(1e-4);
  const double depth = step.normal.dot(step.q - step.point);
  if (depth < 0.0) step.q -= depth * step.normal;  // outside, or touching
  step.p = step.q + random.in_box<3>(4e-4);
  step.K = random.log_uniform(1e3, 1e7);
  StepLimits& limits = step.limits;
  limits.hard[limits.hard_count++] = {Vec3::Zero(), random.uniform(1e-5, 3e-4), Limit::speed};
  limits.hard[limits.hard_count++] = {random.in_box<3>(1e-5), random.uniform(5e-5, 3e-4), Limit::acceleration};
  for (int i = random.below(4); i > 0; --i) {
    limits.planes[limits.plane_count++] = {random.direction<3>(), random.uniform(0.0, 2e-4),
                                           ActiveLimits::of(Limit::joint_speed)};
  }
  return step;
}

struct Solved {
  Vec3 q, limit_force, contact_force;
  ActiveLimits active;
};

Solved solve(models::GeometricAlgorithm<3>& contacts, const RandomStep& step, double K, const Vec3& p) {
  LimitedAlgorithm<3> limited(contacts);
  limited.set_limits(step.limits, Eigen::Matrix3d::Identity(), step.q);
  const Vec3 q = limited(K, p, step.q);
  const Vec3 limit_force = K * limited.limit_shift();
  return {q, limit_force, K * (q - p) - limit_force, limited.active()};
}

Solved solve(const RandomStep& step, double K, const Vec3& p) {
  models::FrictionPlane<3> wall(step.point, step.normal, step.friction);
  return solve(wall, step, K, p);
}

testing::NearestPoint<3> sets_of(const StepLimits& limits) {
  testing::NearestPoint<3> sets;
  for (std::size_t i = 0; i < limits.hard_count; ++i) sets.ball(limits.hard[i].centre, limits.hard[i].radius_m);
  for (std::size_t i = 0; i < limits.plane_count; ++i) sets.plane(limits.planes[i].normal, limits.planes[i].bound_m);
  return sets;
}

double beyond(const StepLimits& limits, const Vec3& x) {
  double most = -1.0;
  for (std::size_t i = 0; i < limits.hard_count; ++i) {
    most = std::max(most, (x - limits.hard[i].centre).norm() - limits.hard[i].radius_m);
  }
  for (std::size_t i = 0; i < limits.plane_count; ++i) {
    most = std::max(most, limits.planes[i].normal.dot(x) - limits.planes[i].bound_m);
  }
  return most;
}

// Planes and balls as there may be in a step, most of them in each other's way, in N dimensions.
template <int N>
void project_at_random(std::uint64_t seed, int most_planes, std::int64_t count) {
  Random random(seed);
  std::int64_t compared = 0, corners = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    LimitSets<N> sets;
    testing::NearestPoint<N> reference;
    StepLimits limits;
    const auto lifted = [](const models::Vec<N>& x) { return models::lift<N>(x); };
    const int planes = random.below(most_planes + 1), balls = random.below(5);
    for (int j = 0; j < planes; ++j) {
      const models::Vec<N> normal = random.direction<N>();
      const double bound_m = random.uniform(-1e-5, 2e-4);
      limits.planes[limits.plane_count++] = {lifted(normal), bound_m, ActiveLimits::of(Limit::joint_speed)};
      reference.plane(normal, bound_m);
    }
    for (int j = 0; j < balls; ++j) {
      const models::Vec<N> centre = random.in_box<N>(1e-4);
      const double radius_m = random.log_uniform(5e-5, 1e-2);
      auto& group = j < 2 ? limits.hard : limits.soft;
      group[j % 2] = {lifted(centre), radius_m, Limit::speed};
      reference.ball(centre, radius_m);
    }
    limits.hard_count = static_cast<std::size_t>(std::min(balls, 2));
    limits.soft_count = static_cast<std::size_t>(std::max(balls - 2, 0));
    sets.set(limits, Eigen::Matrix<double, 3, N>::Identity());
    const models::Vec<N> y = random.in_box<N>(random.log_uniform(1e-4, 1e-1));
    int sweeps = 3000;
    const auto found = sets.nearest(y, true, sweeps);
    models::Vec<N> x;
    if (!reference.find(y, x)) {
      ASSERT_FALSE(found.exact) << i << ": what has no point in common";
      continue;
    }
    ++compared;
    if (found.count == N) ++corners;
    // Where sets only just have a point in common, neither of the two may see it.
    if (!found.exact) continue;
    ASSERT_TRUE(sets.contains(found.x, 1e-12, true)) << i;
    // Two that are all but parallel meet within rounding (1e-13 m are let through) over the angle between them.
    ASSERT_LE((found.x - x).norm(), 1e-9) << i;
    // The projection's derivative, by differences: between corners of the way it is smooth.
    const models::Vec<N> way = random.direction<N>();
    const auto there = sets.nearest(y + 1e-8 * way, true, sweeps);
    if (there.count != found.count || there.members != found.members) continue;
    ASSERT_LE((there.x - found.x - 1e-8 * found.derivative(way)).norm(), 1e-11) << i;
  }
  EXPECT_GT(compared, count / 4);
  EXPECT_GT(corners, count / 50);
}

TEST(LimitSets, GiveTheirNearestPoint) {
  project_at_random<1>(16, 4, tests::scaled(1000));
  project_at_random<2>(17, 8, tests::scaled(2000));
  project_at_random<3>(18, 10, tests::scaled(2000));
  project_at_random<3>(19, 40, tests::scaled(50));
}

TEST(LimitSets, KeepToAPointWhereABallHasNoRadius) {
  StepLimits limits;
  limits.hard[limits.hard_count++] = {Vec3(1e-4, 0.0, 0.0), 0.0, Limit::acceleration};
  limits.planes[limits.plane_count++] = {Vec3::UnitX(), 2e-4, ActiveLimits::of(Limit::workspace)};
  LimitSets<3> sets;
  sets.set(limits, Eigen::Matrix3d::Identity());
  int sweeps = 3000;
  const auto found = sets.nearest(Vec3(1.0, 1.0, 0.0), true, sweeps);
  EXPECT_EQ(found.x, Vec3(1e-4, 0.0, 0.0));
  EXPECT_EQ(found.derivative(Vec3::UnitY()), Vec3::Zero());
  EXPECT_TRUE(found.active.has(Limit::acceleration));
  EXPECT_FALSE(found.active.has(Limit::workspace));
}

// 200,000 steps each at PROXARM_TEST_SCALE=21.
TEST(Limits, AreMetTogetherWithAWallByTheNearestPointOfBoth) {
  Random random(12);
  const std::int64_t count = tests::scaled(10000);
  std::int64_t limited = 0, both = 0, off = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    const RandomStep step = random_step(random, 0.0);
    const Solved solved = solve(step, step.K, step.p);
    ASSERT_LE(beyond(step.limits, solved.q - step.q), 1e-9) << i;
    // q₁ is in both sets, or nearly: the acceleration's ball may leave it out. Then the wall may have to give way.
    const bool common = beyond(step.limits, Vec3::Zero()) <= 0.0;
    if (!common) continue;
    const double depth = step.normal.dot(solved.q - step.point);
    ASSERT_GE(depth, -1e-9) << i;
    if (solved.active.kinds == 0) continue;
    ++limited;
    if (depth < 1e-9) ++both;
    testing::NearestPoint<3> sets = sets_of(step.limits);
    sets.plane(-step.normal, step.normal.dot(step.q - step.point));
    Vec3 x;
    ASSERT_TRUE(sets.find(step.p - step.q, x)) << i;
    if (!((solved.q - step.q - x).norm() <= 1e-8)) ++off;
  }
  EXPECT_GT(limited, count / 3);
  EXPECT_GT(both, count / 50);
  EXPECT_EQ(off, 0) << "of " << limited;
  RecordProperty("off", std::to_string(off) + " of " + std::to_string(limited));
}

// A corner of three faces through step.point instead of the wall, with q₁ anywhere in it, on its faces or in its tip.
std::vector<models::Face> random_corner(Random& random, RandomStep& step) {
  std::vector<models::Face> faces;
  for (int k = 0; k < 3; ++k) {
    faces.push_back({models::FlatSurface<3>(step.point, random.direction<3>()), step.friction});
  }
  const auto allowed = [&] {
    return std::all_of(faces.begin(), faces.end(), [&](const auto& f) { return f.surface.height(step.q) >= 0.0; });
  };
  for (int k = 0; k < 10 && !allowed(); ++k) {
    for (const models::Face& face : faces) {
      if (face.surface.height(step.q) < 0.0) step.q = face.surface.projection(step.q);
    }
  }
  if (!allowed()) step.q = step.point;
  step.p = step.q + random.in_box<3>(4e-4);
  return faces;
}

TEST(Limits, AreMetTogetherWithACornerByTheNearestPointOfAll) {
  Random random(15);
  const std::int64_t count = tests::scaled(3000);
  std::int64_t limited = 0, off = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    RandomStep step = random_step(random, 0.0);
    const std::vector<models::Face> faces = random_corner(random, step);
    if (beyond(step.limits, Vec3::Zero()) > 0.0) continue;
    models::PlaneComposition corner(faces);
    const Solved solved = solve(corner, step, step.K, step.p);
    ASSERT_LE(beyond(step.limits, solved.q - step.q), 1e-9) << i;
    if (solved.active.kinds == 0) continue;
    ++limited;
    testing::NearestPoint<3> sets = sets_of(step.limits);
    for (const models::Face& face : faces) sets.plane(-face.surface.normal(), face.surface.height(step.q));
    Vec3 x;
    if (!sets.find(step.p - step.q, x)) continue;  // a tip that rounding has closed
    if (!((solved.q - step.q - x).norm() <= 1e-8)) ++off;
  }
  EXPECT_GT(limited, count / 4);
  EXPECT_EQ(off, 0) << "of " << limited;
  RecordProperty("off", std::to_string(off) + " of " + std::to_string(limited));
}

// Whether the same force with another κ leads to another point than it did.
bool differs(models::GeometricAlgorithm<3>& contacts, const RandomStep& step, const Solved& solved, double kappa) {
  const Vec3 f = step.K * (solved.q - step.p);
  const Solved again = solve(contacts, step, kappa, solved.q - f / kappa);
  return !((again.q - solved.q).norm() <= 1e-8);
}

// Assumption 1 holds for the whole: what is found with one κ is found with another under the same force. At most one of
// `one_in` may differ; 0: none.
void expect_K_independence(std::uint64_t seed, double most_friction, std::int64_t one_in) {
  Random random(seed);
  const std::int64_t count = tests::scaled(10000);
  std::int64_t limited = 0, differ = 0, outside = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    const RandomStep step = random_step(random, random.uniform(0.0, most_friction));
    if (beyond(step.limits, Vec3::Zero()) > 0.0) continue;
    models::FrictionPlane<3> wall(step.point, step.normal, step.friction);
    const Solved solved = solve(wall, step, step.K, step.p);
    ASSERT_LE(beyond(step.limits, solved.q - step.q), 1e-9) << i;
    const double f_n = step.normal.dot(solved.contact_force);
    const double f_t = (solved.contact_force - f_n * step.normal).norm();
    const double rounding = step.K * 2e-9;
    if (f_t > step.friction * f_n + rounding) ++outside;
    if (solved.active.kinds == 0) continue;
    ++limited;
    if (differs(wall, step, solved, step.K * random.log_uniform(0.1, 10.0))) ++differ;
  }
  EXPECT_GT(limited, count / 4);
  EXPECT_EQ(outside, 0) << "of " << limited;
  EXPECT_LE(differ, one_in == 0 ? 0 : 2 + limited / one_in) << "of " << limited;
  ::testing::Test::RecordProperty("differ", std::to_string(differ) + " of " + std::to_string(limited));
}

TEST(Limits, KeepKIndependence) { expect_K_independence(13, 0.0, 0); }

// But where Coulomb's law has several solutions, and where no way to one ends.
TEST(Limits, KeepKIndependenceAndTheFrictionCone) { expect_K_independence(13, 0.8, 500); }

// Grooves sharper than 2 atan μ jam, which is one more solution.
TEST(Limits, KeepKIndependenceInACornerWithFriction) {
  Random random(20);
  const std::int64_t count = tests::scaled(3000);
  std::int64_t limited = 0, differ = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    RandomStep step = random_step(random, random.uniform(0.0, 0.8));
    models::PlaneComposition corner(random_corner(random, step));
    if (beyond(step.limits, Vec3::Zero()) > 0.0) continue;
    const Solved solved = solve(corner, step, step.K, step.p);
    ASSERT_LE(beyond(step.limits, solved.q - step.q), 1e-9) << i;
    if (solved.active.kinds == 0) continue;
    ++limited;
    if (differs(corner, step, solved, step.K * random.log_uniform(0.1, 10.0))) ++differ;
  }
  EXPECT_GT(limited, count / 4);
  EXPECT_LE(differ, 2 + limited / 50) << "of " << limited;
  RecordProperty("differ", std::to_string(differ) + " of " + std::to_string(limited));
}

TEST(Limits, LeaveAStepThatTheyDontTouchAsItIs) {
  Random random(14);
  for (int i = 0; i < 2000; ++i) {
    RandomStep step = random_step(random, 0.3);
    for (std::size_t j = 0; j < step.limits.hard_count; ++j) step.limits.hard[j].radius_m = 1.0;
    step.limits.plane_count = 0;
    models::FrictionPlane<3> wall(step.point, step.normal, step.friction);
    const Solved solved = solve(step, step.K, step.p);
    ASSERT_EQ(solved.active.kinds, 0);
    ASSERT_EQ(solved.q, wall(step.K, step.p, step.q));
  }
}

// A wall too fast for the acceleration gives way, by no more than braking takes.
TEST(Limits, LetAWallGiveWayBeforeTheAccelerationDoes) {
  constexpr double wall_at = 0.01;
  models::Plane<3> wall(Vec3(wall_at, 0.0, 0.0), -Vec3::UnitX());
  LimitedAlgorithm<3> limited(wall);
  AdmittanceProxy<3> proxy({.mass_kg = 4.0}, limited);
  proxy.start({.v = Vec3(0.5, 0.0, 0.0)});
  const double a = 20.0, T = 1e-3;
  double deepest = 0.0;
  Vec3 q2 = Vec3(-0.5e-3, 0.0, 0.0), q1 = Vec3::Zero();
  for (int k = 0; k < 200; ++k) {
    StepLimits limits;
    limits.hard[0] = {Vec3::Zero(), 0.5 * T, Limit::speed};
    limits.hard[1] = {q1 - q2, a * T * T, Limit::acceleration};
    limits.hard_count = 2;
    limited.set_limits(limits, Eigen::Matrix3d::Identity(), proxy.q());
    ASSERT_EQ(proxy.step(Vec3::Zero()), ProxyFault::none);
    ASSERT_LE((proxy.q() - 2.0 * q1 + q2).norm(), a * T * T + 1e-11);
    q2 = q1;
    q1 = proxy.q();
    deepest = std::max(deepest, proxy.q().x() - wall_at);
  }
  EXPECT_GT(deepest, 5.5e-3);  // v²/2a = 6.25 mm
  EXPECT_LT(deepest, 6.6e-3);
  EXPECT_LT(proxy.q().x() - wall_at, 1e-9) << "and it comes out again";
}

}  // namespace
}  // namespace proxarm::controller
