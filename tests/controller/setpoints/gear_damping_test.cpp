// Damping by the gears' torque, held against the equation of one mode solved by itself, and against what it says that a
// wrong reading may do.
#include "controller/setpoints/gear_damping.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "models/description/cell.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::Arm;
using models::JointVector;

constexpr double T = 1e-3;

description::Cell measuring_cell(double delay_s = 0.0) {
  description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  for (description::DriveDescription& drive : cell.drives) {
    drive.gear_torque = description::GearTorque{.object = 0x203100, .Nm_per_count = 0.05, .delay_s = delay_s};
  }
  return cell;
}

// The decay rate of a free swing, from the largest torques of its first and of its last quarter.
template <class Step>
double decay_per_s(Step step, double seconds) {
  double first = 0.0, last = 0.0;
  const int cycles = static_cast<int>(seconds / T);
  for (int k = 0; k < cycles; ++k) {
    const double torque = std::abs(step());
    if (4 * k < cycles) first = std::max(first, torque);
    if (4 * k >= 3 * cycles) last = std::max(last, torque);
  }
  return std::log(first / last) / (0.75 * seconds);
}

// One link of M = k/ω² on the first joint's gear, integrated here in steps of a twentieth of a period; its motor goes
// where the damping sends it, at once. The torque follows τ̈ + κ G τ̇ + ω² τ = 0, where G is what the band leaves of an
// integral at ω: τ decays as exp(−t Re(κ s²/(s + a)²)/2) does at s = jω.
TEST(GearDamping, DampsAModeAsItsEquationSays) {
  const description::Cell cell = measuring_cell();
  const Arm arm(cell);
  const double k = cell.drives[0].gear_stiffness_Nm_per_rad, kappa = 20.0;
  for (const double f_Hz : {8.0, 15.0, 25.0}) {
    GearDamping damping(arm, cell.drives, {kappa, 1}, T);
    const double omega = 2.0 * std::numbers::pi * f_Hz;
    double link = 1e-3, speed = 0.0, motor = 0.0;
    JointVector torque = JointVector::Zero(6);
    const JointVector asked = JointVector::Zero(6);
    damping.step(asked, torque);
    const double found = decay_per_s(
        [&] {
          constexpr int parts = 20;
          for (int i = 0; i < parts; ++i) {
            speed += omega * omega * (motor - link) * T / parts;
            link += speed * T / parts;
          }
          torque[0] = k * (motor - link);
          motor = damping.step(asked, torque)[0];
          return torque[0];
        },
        0.5);
    const double r = omega / std::hypot(omega, gear_damping_band_rad_per_s);
    const double lead = 2.0 * std::atan(gear_damping_band_rad_per_s / omega);
    // The reading is held for a period, which turns the yielding by half a period more.
    const double expected = 0.5 * kappa * r * r * std::cos(lead - 1.5 * omega * T);
    EXPECT_NEAR(found, expected, 0.15 * kappa / 2.0) << f_Hz << " Hz: " << found << " of " << expected << " per second";
  }
}

TEST(GearDamping, MovesNothingWhereTheGearsCarryWhatTheyAreAskedTo) {
  const description::Cell cell = measuring_cell();
  const Arm arm(cell);
  GearDamping damping(arm, cell.drives, {200.0, 0b111}, T);
  const double lag = gear_torque_lag_periods(1.0 / (2.0 * std::numbers::pi * 100.0), 0.0, T);
  const auto asked_at = [](double cycle) {
    return JointVector(JointVector::Constant(6, 50.0 * std::sin(0.03 * cycle)));
  };
  JointVector most = JointVector::Zero(6);
  for (int k = 0; k < 3000; ++k) {
    // Until the first setpoint has come through, the torque is what it was.
    const JointVector added = damping.step(asked_at(k), asked_at(std::max(0.0, k - lag)));
    if (k > 500) most = most.cwiseMax(added.cwiseAbs());
  }
  // Between two cycles the model is a straight line: 50 Nm · (0.03)²/8, times κ/(2a k).
  EXPECT_LT(most[0], 50.0 * 0.03 * 0.03 / 8.0 * 200.0 / (2.0 * gear_damping_band_rad_per_s * 115000.0) * 1.2);
}

TEST(GearDamping, BeginsWithNothingWhateverTheReading) {
  const description::Cell cell = measuring_cell();
  const Arm arm(cell);
  GearDamping damping(arm, cell.drives, {200.0, 0b111111}, T);
  const JointVector weight = JointVector::Constant(6, 300.0), reading = JointVector::Constant(6, -1000.0);
  for (int k = 0; k < 200; ++k) ASSERT_EQ(damping.step(weight, reading), JointVector::Zero(6)) << "an offset";
  damping.step(weight, weight);
  EXPECT_NE(damping.step(weight, weight)[0], 0.0);
  damping.start();
  EXPECT_EQ(damping.step(weight, reading)[0], 0.0);
}

// κ τ_e/(k a e), e = 2.718…: what a reading that is wrong from one cycle to the next does at most.
TEST(GearDamping, AWrongReadingMovesAMotorNoFurtherThanIsSaid) {
  const description::Cell cell = measuring_cell();
  const Arm arm(cell);
  const double kappa = 220.0, wrong_Nm = 400.0;
  GearDamping damping(arm, cell.drives, {kappa, 1}, T);
  const JointVector none = JointVector::Zero(6);
  JointVector reading = none;
  damping.step(none, none);
  reading[0] = wrong_Nm;
  double most = 0.0;
  for (int k = 0; k < 1000; ++k) most = std::max(most, std::abs(damping.step(none, reading)[0]));
  const double said =
      kappa * wrong_Nm / (cell.drives[0].gear_stiffness_Nm_per_rad * gear_damping_band_rad_per_s * std::numbers::e);
  EXPECT_LE(most, 1.02 * said);  // the period's two hundredth of the band's 25 ms
  EXPECT_GE(most, 0.95 * said);
  EXPECT_LT(std::abs(damping.step(none, reading)[0]), 1e-9 * said) << "it forgets";
}

TEST(GearDamping, KnowsAReadingOfTheWrongSignByTheWeight) {
  const description::Cell cell = measuring_cell();
  const Arm arm(cell);
  GearDamping damping(arm, cell.drives, {100.0, 0b111}, T);
  JointVector weight = JointVector::Zero(6);
  weight << 0.0, 200.0, -60.0, 5.0, 0.0, 0.0;
  const auto judged = [&](const JointVector& read) {
    damping.start();
    for (int k = 0; k < 10; ++k) damping.stand(weight, read);
    const auto reversed = damping.reversed();
    return reversed ? reversed->joint : -1;
  };
  EXPECT_FALSE(damping.reversed()) << "it hasn't stood yet";
  EXPECT_EQ(judged(weight), -1);
  EXPECT_EQ(judged(-weight), 1);
  EXPECT_EQ(judged(-0.4 * weight), 1);
  EXPECT_EQ(judged(JointVector::Zero(6)), -1) << "one that reads nothing isn't reversed";
  JointVector elbow = weight;
  elbow[2] = 60.0;
  EXPECT_EQ(judged(elbow), 2);
  // 4/3 of the elbow's weight is the offset at its edge.
  EXPECT_EQ(judged(weight + JointVector::Constant(6, 79.0)), -1);
  EXPECT_EQ(judged(weight + JointVector::Constant(6, 81.0)), 2);
  weight << 0.0, 200.0, -49.0, 5.0, 0.0, 0.0;
  EXPECT_EQ(judged(JointVector(weight.cwiseProduct((JointVector(6) << 1, 1, -1, 1, 1, 1).finished()))), -1)
      << "less than a quarter of the shoulder's";
}

TEST(GearDamping, LeavesJointsAloneThatSwingTooFastForIt) {
  const description::Cell cell = measuring_cell();
  const Arm arm(cell);
  EXPECT_EQ(damped_joints(arm, cell.drives, 1e-3), 0b000111) << "the wrist's swing at 100 to 400 Hz";
  EXPECT_EQ(damped_joints(arm, cell.drives, 20e-3), 0) << "a yielding after 30 ms drives a mode of 17 Hz";
  description::Cell one = cell;
  for (std::size_t i = 1; i < one.drives.size(); ++i) one.drives[i].gear_torque.reset();
  EXPECT_EQ(damped_joints(Arm(one), one.drives, 1e-3), 0b000001) << "only what is measured";
  const description::Cell plain = description::load_cell(source_file("models/cells/default.yaml"));
  EXPECT_EQ(damped_joints(Arm(plain), plain.drives, 1e-3), 0);
}

TEST(GearDamping, GoesOnWithAnotherTimestepWhereItWas) {
  const description::Cell cell = measuring_cell();
  const Arm arm(cell);
  GearDamping damping(arm, cell.drives, {100.0, 1}, T);
  const JointVector none = JointVector::Zero(6);
  JointVector reading = none, before = none;
  damping.step(none, none);
  reading[0] = 10.0;
  for (int k = 0; k < 20; ++k) before = damping.step(none, reading);
  damping.set_period(2e-3);
  const JointVector after = damping.step(none, reading);
  EXPECT_NEAR(after[0], before[0], 0.12 * std::abs(before[0])) << "2 ms of 20 more";
}

}  // namespace
}  // namespace proxarm::controller
