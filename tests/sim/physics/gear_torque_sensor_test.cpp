// What a simulated drive reads of its gear's torque, by what its description says.
#include "sim/physics/gear_torque_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace proxarm::sim {
namespace {

constexpr std::int64_t step_ns = 250'000;

description::DriveDescription drive() {
  description::DriveDescription d;
  d.gear_stiffness_Nm_per_rad = 1e5;
  d.gear_torque = description::GearTorque{.object = 0x203100, .bits = 16, .Nm_per_count = 0.05};
  return d;
}

TEST(GearTorqueSensor, ReadsTheTorqueInItsCounts) {
  GearTorqueSensor sensor(drive(), step_ns, 1);
  sensor.reset(10.0, 0.3);
  EXPECT_EQ(sensor.counts(), 200);
  sensor.set(-10.026, 0.3);
  EXPECT_EQ(sensor.counts(), -201);
  sensor.set(1e6, 0.3);
  EXPECT_EQ(sensor.counts(), 32767) << "cut to its bits";
}

TEST(GearTorqueSensor, IsAsLateAsItsDescriptionSays) {
  auto late = drive();
  late.gear_torque->delay_s = 1e-3;
  GearTorqueSensor sensor(late, step_ns, 1);
  sensor.reset(0.0, 0.0);
  for (int step = 1; step <= 8; ++step) {
    sensor.set(5.0 * step, 0.0);
    EXPECT_EQ(sensor.counts(), step > 4 ? 100 * (step - 4) : 0) << step;
  }
}

TEST(GearTorqueSensor, ASecondEncoderReadsTheLinksAngle) {
  auto encoder = drive();
  encoder.gear_torque = description::GearTorque{.object = 0x60E401, .bits = 32, .counts_per_revolution = -8'388'608.0};
  GearTorqueSensor sensor(encoder, step_ns, 1);
  sensor.reset(0.0, 1.0);
  EXPECT_EQ(sensor.counts(), std::lround(-8'388'608.0 / (2.0 * std::numbers::pi)));
}

TEST(GearTorqueSensor, HasTheErrorsThatItIsGiven) {
  auto wrong = drive();
  wrong.simulation.gear_torque_ratio = 1.2;
  wrong.simulation.gear_torque_offset_Nm = 3.0;
  wrong.simulation.gear_torque_hysteresis_Nm = 2.0;
  GearTorqueSensor sensor(wrong, step_ns, 1);
  sensor.reset(0.0, 0.0);
  EXPECT_EQ(sensor.counts(), 60);
  sensor.set(10.0, 0.0);
  EXPECT_EQ(sensor.counts(), std::lround((1.2 * 9.0 + 3.0) / 0.05)) << "half the loop behind";
  sensor.set(8.5, 0.0);
  EXPECT_EQ(sensor.counts(), std::lround((1.2 * 9.0 + 3.0) / 0.05)) << "still within the loop";
  sensor.set(0.0, 0.0);
  EXPECT_EQ(sensor.counts(), std::lround((1.2 * 1.0 + 3.0) / 0.05));
}

TEST(GearTorqueSensor, ItsNoiseIsWhiteAndAsLargeAsItIsGiven) {
  auto noisy = drive();
  noisy.simulation.gear_torque_noise_Nm = 2.0;
  GearTorqueSensor sensor(noisy, step_ns, 7);
  sensor.reset(0.0, 0.0);
  constexpr int readings = 20'000;
  double sum = 0.0, squares = 0.0, products = 0.0, before = 0.0;
  for (int i = 0; i < readings; ++i) {
    sensor.set(0.0, 0.0);
    const double Nm = 0.05 * sensor.counts();
    sum += Nm;
    squares += Nm * Nm;
    products += Nm * before;
    before = Nm;
  }
  // Four standard deviations of each estimate.
  EXPECT_NEAR(sum / readings, 0.0, 4.0 * 2.0 / std::sqrt(readings));
  EXPECT_NEAR(std::sqrt(squares / readings), 2.0, 4.0 * 2.0 / std::sqrt(2.0 * readings));
  EXPECT_NEAR(products / squares, 0.0, 4.0 / std::sqrt(readings));
}

TEST(GearTorqueSensor, OneThatSticksRepeatsItself) {
  GearTorqueSensor sensor(drive(), step_ns, 1);
  sensor.reset(1.0, 0.0);
  sensor.stick(true);
  sensor.set(50.0, 0.0);
  EXPECT_EQ(sensor.counts(), 20);
  sensor.stick(false);
  sensor.set(50.0, 0.0);
  EXPECT_EQ(sensor.counts(), 1000);
}

}  // namespace
}  // namespace proxarm::sim
