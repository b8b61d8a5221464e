#include "controller/proxies/orientation_proxy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "models/base/setup_error.hpp"

namespace proxarm::controller {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using models::Vec3;

double angle_between(const Quaterniond& a, const Quaterniond& b) {
  const Quaterniond d = a.conjugate() * b;
  return 2.0 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

const Quaterniond tilted = Quaterniond(AngleAxisd(0.6, Vec3(1.0, -2.0, 0.5).normalized()));

TEST(OrientationProxy, HeldStaysBitForBit) {
  OrientationProxy proxy({.free = false});
  ASSERT_TRUE(proxy.start(tilted));
  const Quaterniond start = proxy.R_WT();
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(proxy.step(Vec3(5.0, -3.0, 2.0)), ProxyFault::none);
  EXPECT_EQ(proxy.R_WT().coeffs(), start.coeffs());
  EXPECT_EQ(proxy.velocity_W(), Vec3::Zero());
}

// A constant torque about one axis: k(k+1)/2 steps of T²τ/J; against the parabola that is half a step of velocity
// early.
TEST(OrientationProxy, TurnsUnderATorqueAsItsInertiaSays) {
  OrientationProxy proxy({.free = true, .inertia_kg_m2 = 0.1, .damping_Nms_per_rad = 0.0, .period_s = 1e-3});
  ASSERT_TRUE(proxy.start(tilted));
  const Vec3 axis = Vec3(0.3, 0.9, -0.1).normalized();
  for (int k = 1; k <= 500; ++k) {
    ASSERT_EQ(proxy.step(0.2 * axis), ProxyFault::none);
    const double angle = 0.5 * k * (k + 1.0) * 1e-6 * 0.2 / 0.1;
    const Quaterniond expected = Quaterniond(AngleAxisd(angle, axis)) * tilted;
    ASSERT_LT(angle_between(expected, proxy.R_WT()), 1e-13);
  }
}

// τ/D, whatever T.
TEST(OrientationProxy, SettlesAtTheSameSpeedForEveryPeriod) {
  for (const double period : {2.5e-4, 1e-3, 4e-3, 1e-2}) {
    OrientationProxy proxy({.free = true,
                            .inertia_kg_m2 = 0.01,
                            .damping_Nms_per_rad = 1.0,
                            .turn = {.max_turn_rad = 3.0},
                            .period_s = period});
    ASSERT_TRUE(proxy.start(Quaterniond::Identity()));
    for (double t = 0.0; t < 0.4; t += period) ASSERT_EQ(proxy.step(Vec3(0.0, 0.0, 0.7)), ProxyFault::none);
    EXPECT_NEAR(proxy.velocity_W().z(), 0.7, 1e-9);
    EXPECT_FALSE(proxy.speed_limited());
  }
}

// Damping far beyond what an explicit step would survive.
TEST(OrientationProxy, IsStableForAnyDamping) {
  OrientationProxy proxy({.free = true, .inertia_kg_m2 = 1e-4, .damping_Nms_per_rad = 1e6});
  ASSERT_TRUE(proxy.start(tilted));
  for (int k = 0; k < 1000; ++k) {
    ASSERT_EQ(proxy.step(Vec3(k % 2 == 0 ? 10.0 : -10.0, 0.0, 0.0)), ProxyFault::none);
    ASSERT_LT(proxy.velocity_W().norm(), 1.1e-5);
  }
}

TEST(OrientationProxy, StaysUnitAndWithinItsLimitsUnderAnyTorque) {
  std::mt19937_64 generator(3);
  std::printf("seed 3\n");
  std::uniform_real_distribution<> torque(-30.0, 30.0);
  for (const double max_angle : {0.0, 0.3, 1.5, 3.0}) {
    OrientationProxy proxy({.free = true,
                            .inertia_kg_m2 = 0.02,
                            .damping_Nms_per_rad = 0.1,
                            .turn = {.max_turn_rad = max_angle, .max_speed_rad_per_s = 5.0},
                            .period_s = 4e-3});
    ASSERT_TRUE(proxy.start(tilted));
    Vec3 load = Vec3::Zero();
    for (int k = 0; k < 20000; ++k) {
      if (k % 50 == 0) load = Vec3(torque(generator), torque(generator), torque(generator));
      const Quaterniond before = proxy.R_WT();
      ASSERT_EQ(proxy.step(load), ProxyFault::none);
      ASSERT_NEAR(proxy.R_WT().norm(), 1.0, 4e-16);
      ASSERT_LE(angle_between(before, proxy.R_WT()), 5.0 * 4e-3 * (1 + 1e-9) + 1e-15);
      ASSERT_LE(angle_between(tilted, proxy.R_WT()), max_angle + 1e-15 * 10);
      ASSERT_LE(proxy.velocity_W().norm(), 5.0 * (1 + 1e-9) + 1e-10);
    }
    // Nothing winds up: let go of, it comes to rest where it is.
    for (int k = 0; k < 2000; ++k) ASSERT_EQ(proxy.step(Vec3::Zero()), ProxyFault::none);
    EXPECT_LT(proxy.velocity_W().norm(), 1e-3);
  }
}

// An arm that couldn't stop takes its proxy along beyond the limit. From there nothing leads further out, and nothing
// leads back faster than the joints can follow.
TEST(OrientationProxy, FromBeyondItsLimitItIsLedBackSlowly) {
  OrientationProxy proxy({.free = true, .turn = {.max_turn_rad = 0.5}, .period_s = 1e-3});
  ASSERT_TRUE(proxy.start(Quaterniond::Identity()));
  const Quaterniond beyond(Eigen::AngleAxisd(0.6, Vec3::UnitX()));
  ASSERT_TRUE(proxy.resume(beyond, Vec3(2.0, 0.0, 0.0)));
  for (int k = 0; k < 2000; ++k) {
    const Quaterniond before = proxy.R_WT();
    ASSERT_EQ(proxy.step(Vec3(5.0, 0.0, 0.0)), ProxyFault::none);
    const double angle = angle_between(Quaterniond::Identity(), proxy.R_WT());
    ASSERT_LE(angle, std::max(0.5, angle_between(Quaterniond::Identity(), before)) + 1e-12);
    ASSERT_LE(angle_between(before, proxy.R_WT()), TurnSets::returning_rad_per_s * 1e-3 + 1e-12);
  }
  EXPECT_NEAR(angle_between(Quaterniond::Identity(), proxy.R_WT()), 0.5, 1e-12);
}

TEST(OrientationProxy, RefusesWhatIsNoNumberAndKeepsItsState) {
  OrientationProxy proxy({.free = true});
  ASSERT_TRUE(proxy.start(tilted));
  ASSERT_EQ(proxy.step(Vec3(0.1, 0.0, 0.0)), ProxyFault::none);
  const Quaterniond R = proxy.R_WT();
  const Vec3 omega = proxy.velocity_W();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(proxy.step(Vec3(0.0, bad, 0.0)), ProxyFault::input_not_finite);
    EXPECT_FALSE(proxy.start(Quaterniond(bad, 0.0, 0.0, 0.0)));
  }
  EXPECT_EQ(proxy.step(Vec3::Constant(1.7e308)), ProxyFault::result_not_finite);
  EXPECT_FALSE(proxy.start(Quaterniond(0.0, 0.0, 0.0, 0.0)));
  EXPECT_FALSE(proxy.start(Quaterniond(1.1, 0.0, 0.0, 0.0)));
  EXPECT_EQ(proxy.R_WT().coeffs(), R.coeffs());
  EXPECT_EQ(proxy.velocity_W(), omega);
}

// The hand's torque is J α about every axis: part of it moves what hangs behind the sensor, which the sensor doesn't
// read.
TEST(OrientationProxy, FeelsLikeABallWhateverHangsBehindTheSensor) {
  constexpr double J = 0.02, T = 1e-5;
  models::Mat3 I;
  I << 4e-3, 1e-3, 0.0, 1e-3, 6e-3, -5e-4, 0.0, -5e-4, 2e-3;
  OrientationProxy proxy({.free = true,
                          .inertia_kg_m2 = J,
                          .behind_sensor_T = I,
                          .damping_Nms_per_rad = 0.0,
                          .turn = {.max_turn_rad = 3.0, .max_speed_rad_per_s = 100.0},
                          .period_s = T});
  ASSERT_TRUE(proxy.start(tilted));
  for (int k = 0; k < 100'000; ++k) {
    const double t = k * T;
    const Vec3 hand(0.05 * std::cos(5.0 * t), 0.08 * std::sin(7.0 * t), 0.03 * std::cos(3.0 * t));
    const models::Mat3 R = proxy.R_WT().toRotationMatrix(), I_W = R * I * R.transpose();
    const Vec3 omega = proxy.velocity_W();
    // The sensor's reading, of the acceleration that this torque causes: J α = hand.
    const Vec3 sensor = hand - I_W * (hand / J) - omega.cross(Vec3(I_W * omega));
    ASSERT_EQ(proxy.step(sensor), ProxyFault::none);
    const Vec3 alpha = (proxy.velocity_W() - omega) / T;
    ASSERT_LT((J * alpha - hand).norm(), 1e-9);  // rounding of ω over T: 1e-16 · 10/1e-5
  }
}

TEST(OrientationProxy, RestsOnItsSpringWhereTheTorqueIsMetAndReturns) {
  OrientationProxy proxy(
      {.free = true, .inertia_kg_m2 = 0.1, .damping_Nms_per_rad = 1.0, .spring_Nm_per_rad = 40.0, .period_s = 1e-3});
  ASSERT_TRUE(proxy.start(tilted));
  for (int k = 0; k < 5000; ++k) ASSERT_EQ(proxy.step(Vec3(4.0, 0.0, 0.0)), ProxyFault::none);
  EXPECT_NEAR(angle_between(tilted, proxy.R_WT()), 0.1, 1e-6);  // τ/K
  proxy.set_spring(1e6);                                        // far beyond what an explicit step would survive
  for (int k = 0; k < 5000; ++k) ASSERT_EQ(proxy.step(Vec3::Zero()), ProxyFault::none);
  EXPECT_LT(angle_between(tilted, proxy.R_WT()), 1e-6);
}

// Whatever is set while it turns, angle and velocity go on, and the spring's torque is what it was.
TEST(OrientationProxy, ChangesWithoutABump) {
  OrientationProxy proxy({.free = true, .inertia_kg_m2 = 0.1, .damping_Nms_per_rad = 0.2, .spring_Nm_per_rad = 5.0});
  ASSERT_TRUE(proxy.start(tilted));
  for (int k = 0; k < 200; ++k) ASSERT_EQ(proxy.step(Vec3(0.5, 0.2, 0.0)), ProxyFault::none);
  proxy.set_inertia(0.03, models::Mat3::Zero());
  proxy.set_damping(0.6);
  proxy.set_spring(50.0);
  const Vec3 before = proxy.velocity_W();
  ASSERT_EQ(proxy.step(Vec3(0.5, 0.2, 0.0)), ProxyFault::none);
  // What the torques of a step do at most: the hand's 0.55 Nm, 0.6 Nms/rad at 1 rad/s, the old spring's 5 Nm/rad at 0.2
  // rad and the new one's on the reference's way back, 0.1 rad/s · 1 ms.
  EXPECT_LT((proxy.velocity_W() - before).norm(), (0.55 + 0.6 + 1.0 + 0.005) * 1e-3 / 0.03);
}

TEST(OrientationProxy, GoesOnWithItsVelocityAfterTheArmCouldNotFollow) {
  OrientationProxy proxy({.free = true, .damping_Nms_per_rad = 0.0});
  ASSERT_TRUE(proxy.start(tilted));
  ASSERT_TRUE(proxy.resume(Quaterniond::Identity(), Vec3(0.0, 0.3, 0.0)));
  ASSERT_EQ(proxy.step(Vec3::Zero()), ProxyFault::none);
  EXPECT_NEAR(angle_between(Quaterniond::Identity(), proxy.R_WT()), 0.3e-3, 1e-12);
}

TEST(OrientationProxy, NamesTheKeyThatIsOutOfRange) {
  try {
    OrientationProxy proxy({.inertia_kg_m2 = 0.0});
    FAIL();
  } catch (const description::SetupError& error) {
    EXPECT_EQ(error.key(), "orientation.inertia");
  }
  EXPECT_THROW(OrientationProxy({.damping_Nms_per_rad = -1.0}), description::SetupError);
  EXPECT_THROW(OrientationProxy({.turn = {.max_turn_rad = 3.1}}), description::SetupError);
  EXPECT_THROW(OrientationProxy({.turn = {.max_speed_rad_per_s = 50.0}, .period_s = 1e-2}), description::SetupError);
}

}  // namespace
}  // namespace proxarm::controller
