// The filter against its exact solution, and the motors' angles against the arm's equation of motion.
#include "controller/setpoints/elastic_setpoint.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "models/description/cell.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::Arm;
using models::JointVector;

constexpr double bandwidth_Hz = 20.0, omega = 2.0 * std::numbers::pi * bandwidth_Hz, T = 1e-3;

description::Cell cell() { return description::load_cell(source_file("models/cells/default.yaml")); }

class ElasticSetpointTest : public ::testing::Test {
 protected:
  // A place a little away from the start, different for each axis.
  [[nodiscard]] JointVector place(double size_rad) const {
    JointVector link = arm.start_rad();
    for (int i = 0; i < arm.axes(); ++i) link[i] += size_rad * (i % 2 == 0 ? 1.0 : -0.5) * (1.0 + 0.1 * i);
    return link;
  }

  Arm arm{cell()};
};

TEST_F(ElasticSetpointTest, AtRestTheMotorsCarryGravityAndNothingElse) {
  ElasticSetpoint elastic(arm, bandwidth_Hz, T);
  const JointVector link = place(0.1);
  elastic.start(link);
  for (int k = 0; k < 100; ++k) {
    const JointVector motor = elastic.step(link);
    ASSERT_EQ(elastic.filter().rad(), link);
    ASSERT_EQ(motor, arm.motor_from_link(link));
  }
}

// Critically damped from rest: e(t) = e₀(1 + ωt)exp(−ωt), ė(t) = −e₀ω²t exp(−ωt). The filter is exact while its input
// holds still, so that the tolerance is rounding of angles of a radian over 300 steps.
TEST_F(ElasticSetpointTest, AnswersAStepAsACriticallyDampedFilterDoes) {
  ElasticSetpoint elastic(arm, bandwidth_Hz, T);
  const JointVector from = place(0.0), to = place(0.02);
  elastic.start(from);
  double nearest = 1.0;
  for (int k = 1; k <= 300; ++k) {
    elastic.step(to);
    const double t = k * T, decay = std::exp(-omega * t);
    const JointVector e = (1.0 + omega * t) * decay * (from - to);
    const JointVector e_dot = -omega * omega * t * decay * (from - to);
    ASSERT_LT((elastic.filter().rad() - (to + e)).norm(), 1e-13) << k;
    ASSERT_LT((elastic.filter().rad_per_s() - e_dot).norm(), 1e-11) << k;
    nearest = std::min(nearest, (to - elastic.filter().rad())[0] / (to - from)[0]);
  }
  EXPECT_GE(nearest, -1e-12) << "it overshoots";
}

TEST_F(ElasticSetpointTest, TenShortPeriodsLeadWhereOneLongOneDoes) {
  ElasticSetpoint fine(arm, bandwidth_Hz, T), coarse(arm, bandwidth_Hz, T);
  fine.start(place(0.0));
  coarse.start(place(0.0));
  // The timestep changes under way, in the middle of a motion.
  fine.step(place(0.02));
  coarse.step(place(0.02));
  coarse.set_period(10.0 * T);
  for (int k = 0; k < 10; ++k) fine.step(place(-0.01));
  coarse.step(place(-0.01));
  EXPECT_LT((fine.filter().rad() - coarse.filter().rad()).norm(), 1e-14);
  EXPECT_LT((fine.filter().rad_per_s() - coarse.filter().rad_per_s()).norm(), 1e-12);
}

// What the stability check counts as the filter's delay. The input stands still within a period, so that its mean is
// T/2 ahead of the value that the period began with.
TEST_F(ElasticSetpointTest, FollowsAConstantSpeedByItsLead) {
  ElasticSetpoint elastic(arm, bandwidth_Hz, T);
  EXPECT_DOUBLE_EQ(elastic.filter().lead_s(), 2.0 / omega);
  elastic.start(arm.start_rad());
  const double speed_rad_per_s = 0.3;
  JointVector link = arm.start_rad();
  for (int k = 1; k <= 1000; ++k) {
    link = arm.start_rad() + JointVector::Constant(arm.axes(), k * T * speed_rad_per_s);
    elastic.step(link);
  }
  for (int i = 0; i < arm.axes(); ++i) {
    EXPECT_NEAR((link - elastic.filter().rad())[i] / speed_rad_per_s, elastic.filter().lead_s() - 0.5 * T, 0.02 * T);
  }
}

// K(θ − q_f) = M(q_f) q̈_f + τ_g(q_f): the twist of the gears carries the acceleration and the weight. q̈_f is measured
// here, from the speeds a moment (0.1 µs) later and before.
TEST_F(ElasticSetpointTest, TheGearsTwistByWhatAccelerationAndGravityAsk) {
  ElasticSetpoint elastic(arm, bandwidth_Hz, T);
  elastic.start(place(0.0));
  const JointVector to = place(0.02);
  double largest_Nm = 0.0;
  for (int k = 0; k < 50; ++k) {
    const JointVector motor = elastic.step(to);
    // The filter's motion is a formula in its period, which may as well be a moment ago: the difference of both sides
    // has no error in the first order of it.
    const double moment_s = 1e-7;
    ElasticSetpoint later = elastic, before = elastic;
    later.set_period(moment_s);
    before.set_period(-moment_s);
    later.step(to);
    before.step(to);
    const JointVector acceleration = (later.filter().rad_per_s() - before.filter().rad_per_s()) / (2.0 * moment_s);
    const JointVector inertial = arm.link_mass_matrix(elastic.filter().rad()) * acceleration;
    const JointVector twist = motor - elastic.filter().rad();
    const JointVector carried = arm.gear_stiffness_Nm_per_rad().cwiseProduct(twist);
    // Rounding of the speed (1e-13 rad/s over 0.1 µs), times the inertia; and of θ, times the stiffness (1e6 Nm).
    ASSERT_LT((carried - arm.gravity_torque(elastic.filter().rad()) - inertial).norm(), 1e-6 * (1.0 + inertial.norm()));
    largest_Nm = std::max(largest_Nm, inertial.norm());
  }
  EXPECT_GT(largest_Nm, 10.0) << "there was nothing to carry";
}

TEST_F(ElasticSetpointTest, ARigidGearIsNotTwisted) {
  description::Cell rigid = cell();
  rigid.drives[1].gear_stiffness_Nm_per_rad = 0.0;
  const Arm other(rigid);
  ElasticSetpoint elastic(other, bandwidth_Hz, T);
  elastic.start(place(0.0));
  for (int k = 0; k < 20; ++k) {
    const JointVector motor = elastic.step(place(0.02));
    ASSERT_EQ(motor[1], elastic.filter().rad()[1]);
    ASSERT_NE(motor[2], elastic.filter().rad()[2]);
  }
}

TEST_F(ElasticSetpointTest, WithoutABandwidthOnlyGravityIsCompensated) {
  ElasticSetpoint elastic(arm, 0.0, T);
  EXPECT_EQ(elastic.filter().lead_s(), 0.0);
  elastic.start(place(0.0));
  for (const double size_rad : {0.02, -0.05, 0.0}) {
    const JointVector link = place(size_rad);
    EXPECT_EQ(elastic.step(link), arm.motor_from_link(link));
    EXPECT_EQ(elastic.filter().rad(), link);
  }
}

TEST_F(ElasticSetpointTest, ResumesWhereTheMotorsAreAndForgetsWhatItWasTold) {
  ElasticSetpoint elastic(arm, bandwidth_Hz, T);
  elastic.start(place(0.0));
  for (int k = 0; k < 20; ++k) elastic.step(place(0.5));
  const JointVector motor = arm.motor_from_link(place(0.01)), still = JointVector::Zero(arm.axes());
  elastic.resume(motor, still);
  const JointVector link = elastic.filter().rad();
  EXPECT_LT((link - place(0.01)).norm(), 1e-12) << "fixed-point iteration of link_from_motor()";
  EXPECT_LT((elastic.step(link) - motor).norm(), 1e-12) << "the drives feel no step";

  const JointVector speed = JointVector::Constant(arm.axes(), 0.2);
  elastic.resume(motor, speed);
  EXPECT_EQ(elastic.filter().rad_per_s(), speed);
  elastic.step(link);
  EXPECT_GT((elastic.filter().rad() - link).minCoeff(), 0.8 * 0.2 * T) << "it goes on at that speed";
}

TEST_F(ElasticSetpointTest, GoesOnFromItsArchiveToTheBit) {
  ElasticSetpoint elastic(arm, bandwidth_Hz, T), copy(arm, bandwidth_Hz, T);
  elastic.start(place(0.0));
  for (int k = 0; k < 20; ++k) elastic.step(place(0.02));
  std::array<std::byte, 512> bytes{};
  auto written = fieldbus::StateArchive::writer(bytes);
  elastic.archive(written);
  auto read = fieldbus::StateArchive::reader(std::span<const std::byte>(bytes).first(written.bytes()));
  copy.archive(read);
  ASSERT_TRUE(written.whole() && read.whole());
  ASSERT_EQ(copy.kinematics().J_W, elastic.kinematics().J_W);
  for (int k = 0; k < 20; ++k) ASSERT_EQ(copy.step(place(-0.02)), elastic.step(place(-0.02)));
}

TEST_F(ElasticSetpointTest, KnowsWhereTheToolIsAtItsAngles) {
  for (const double bandwidth : {bandwidth_Hz, 0.0}) {
    ElasticSetpoint elastic(arm, bandwidth, T);
    const auto expect_there = [&] {
      models::ToolKinematics there;
      arm.kinematics(elastic.filter().rad(), there);
      EXPECT_EQ(elastic.kinematics().X_WT.matrix(), there.X_WT.matrix());
      EXPECT_EQ(elastic.kinematics().J_W, there.J_W);
    };
    expect_there();
    elastic.start(place(0.01));
    expect_there();
    elastic.step(place(0.02));
    expect_there();
    elastic.resume(place(0.03), JointVector::Constant(arm.axes(), 0.1));
    expect_there();
  }
}

}  // namespace
}  // namespace proxarm::controller
