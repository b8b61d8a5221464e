// Tilt and twist, judged by where the axis points and by what is left once it is led back the shortest way.
#include "controller/proxies/axis_range.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "controller/proxies/orientation_proxy.hpp"
#include "models/base/random.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::controller {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using models::Random;
using models::Vec3;

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

double tilt_of(const Quaterniond& start, const Quaterniond& R, const Vec3& axis) {
  return angle_between(start * axis, R * axis);
}

double twist_of(const Quaterniond& start, const Quaterniond& R, const Vec3& axis) {
  const Quaterniond back = Quaterniond::FromTwoVectors(R * axis, start * axis);
  const AngleAxisd left(back * R * start.conjugate());
  return std::abs(std::remainder(left.angle(), 2.0 * M_PI));
}

const Quaterniond begun(AngleAxisd(0.6, Vec3(1.0, -2.0, 0.5).normalized()));

OrientationConfig turning(const AxisRange& range) {
  return {.free = true,
          .inertia_kg_m2 = 0.02,
          .damping_Nms_per_rad = 0.1,
          .turn = {.max_turn_rad = 1.5, .axis_range = range, .max_speed_rad_per_s = 2.0}};
}

TEST(AxisRange, NoTorqueTiltsOrTwistsTheToolFurther) {
  Random random(5);
  for (int run = 0; run < 12; ++run) {
    const AxisRange range{random.chance(0.3) ? 0.0 : random.uniform(0.01, 1.2),
                          random.chance(0.3) ? AxisRange::everything : random.uniform(0.0, 1.0), random.direction()};
    OrientationProxy proxy(turning(range));
    ASSERT_TRUE(proxy.start(begun));
    Vec3 load = Vec3::Zero();
    double most_tilt = 0.0, most_twist = 0.0;
    for (int k = 0; k < 8000; ++k) {
      if (k % 400 == 0) load = random.in_box(10.0);
      const Quaterniond before = proxy.R_WT();
      ASSERT_EQ(proxy.step(load), ProxyFault::none);
      most_tilt = std::max(most_tilt, tilt_of(begun, proxy.R_WT(), range.axis_T));
      most_twist = std::max(most_twist, twist_of(begun, proxy.R_WT(), range.axis_T));
      // To a thousandth of a thousandth, as said of kShorter.
      ASSERT_LE(AngleAxisd(before.conjugate() * proxy.R_WT()).angle(), (1.0 + 1e-6) * 2e-3)
          << "run " << run << ", step " << k;
    }
    // 1e-15 for each of some ten quaternions.
    EXPECT_LE(most_tilt, range.max_tilt_rad + 1e-14);
    EXPECT_LE(most_twist, range.max_twist_rad + 1e-14);
    EXPECT_GT(most_tilt, 0.9 * range.max_tilt_rad) << "run " << run;
    const double twist_seen = range.max_twist_rad < AxisRange::everything ? 0.9 * range.max_twist_rad : 0.0;
    EXPECT_GE(most_twist, twist_seen) << "run " << run;
  }
}

// A tool that turns freely, by 0.1 to 20 mrad a step, gets no energy from a border. (Far from the start a small step of
// the axis may be a large one of tilt and twist: up to 3 rad it was longer by 40 times.)
TEST(AxisRange, AStepAtABorderIsNoLongerThanTheOneThatWasAskedFor) {
  Random random(6);
  const double back_rad = TurnSets::returning_rad_per_s * 1e-3;
  int limited = 0;
  for (int k = 0; k < 100'000; ++k) {
    const AxisRange range{random.uniform(0.0, 3.0), random.uniform(0.0, 3.0), random.direction()};
    const Vec3 across = range.axis_T.cross(random.direction()).normalized();
    const double tilt = std::max(0.0, range.max_tilt_rad - random.log_uniform(1e-6, 1.0)),
                 twist = std::max(0.0, range.max_twist_rad - random.log_uniform(1e-6, 1.0));
    const Quaterniond from = begun * AngleAxisd(tilt, across) * AngleAxisd(twist, range.axis_T);
    const double asked_rad = random.log_uniform(back_rad, 0.02);
    Quaterniond to = AngleAxisd(asked_rad, random.direction()) * from;
    limited += range.keep(begun, from, {1e-3, 0.1}, to) ? 1 : 0;
    ASSERT_LE(AngleAxisd(to * from.conjugate()).angle(), asked_rad * (1.0 + 1e-3) + 1e-12) << k;
  }
  EXPECT_GT(limited, 20'000);
}

TEST(AxisRange, ATiltThatIsHeldLetsTheToolTwistOn) {
  OrientationProxy proxy(turning({.max_tilt_rad = 0.0}));
  ASSERT_TRUE(proxy.start(begun));
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(proxy.step(begun * Vec3(3.0, -2.0, 0.1)), ProxyFault::none);
  EXPECT_LE(tilt_of(begun, proxy.R_WT(), Vec3::UnitZ()), 1e-14);
  EXPECT_GT(twist_of(begun, proxy.R_WT(), Vec3::UnitZ()), 0.3);
  EXPECT_TRUE(proxy.angle_limited());
}

TEST(AxisRange, FromBeyondItTheToolIsLedBackSlowly) {
  OrientationProxy proxy(turning({.max_tilt_rad = 0.2, .max_twist_rad = 0.1}));
  ASSERT_TRUE(proxy.start(begun));
  const Quaterniond beyond = begun * AngleAxisd(0.3, Vec3::UnitX()) * AngleAxisd(-0.25, Vec3::UnitZ());
  ASSERT_TRUE(proxy.resume(beyond, Vec3(2.0, 1.0, 0.0)));
  for (int k = 0; k < 2500; ++k) {
    const Quaterniond before = proxy.R_WT();
    ASSERT_EQ(proxy.step(begun * Vec3(5.0, 0.0, -2.0)), ProxyFault::none);
    const double step = TurnSets::returning_rad_per_s * 1e-3 + 1e-12;
    ASSERT_LE(tilt_of(begun, before, Vec3::UnitZ()) - tilt_of(begun, proxy.R_WT(), Vec3::UnitZ()), step);
    ASSERT_LE(twist_of(begun, before, Vec3::UnitZ()) - twist_of(begun, proxy.R_WT(), Vec3::UnitZ()), step);
  }
  EXPECT_NEAR(tilt_of(begun, proxy.R_WT(), Vec3::UnitZ()), 0.2, 1e-12);
  EXPECT_NEAR(twist_of(begun, proxy.R_WT(), Vec3::UnitZ()), 0.1, 1e-12);
}

TEST(AxisRange, WithoutLimitsNothingIsToBeKept) {
  EXPECT_FALSE(AxisRange{}.limits());
  Quaterniond to(AngleAxisd(2.9, Vec3::UnitX()));
  EXPECT_FALSE(AxisRange{}.keep(begun, begun, {}, to));
  EXPECT_EQ(to.coeffs(), Quaterniond(AngleAxisd(2.9, Vec3::UnitX())).coeffs());
}

TEST(AxisRange, RefusesAnglesOutOfRange) {
  EXPECT_THROW(OrientationProxy(turning({.max_tilt_rad = -0.1})), description::SetupError);
  EXPECT_THROW(OrientationProxy(turning({.max_twist_rad = 3.1})), description::SetupError);
  EXPECT_NO_THROW(OrientationProxy(turning({.max_tilt_rad = 0.0, .max_twist_rad = 3.0})));
}

}  // namespace
}  // namespace proxarm::controller
