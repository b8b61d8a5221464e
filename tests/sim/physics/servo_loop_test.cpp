#include "sim/physics/servo_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/cell/default_cell.hpp"

namespace proxarm::sim {
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t servo_ns = 250'000;

// A drive on a rotor that obeys at once: shows the setpoint alone, without mechanics.
struct Setpoints {
  description::DriveDescription drive = default_cell().drives[1];  // direction −1, offset not 0
  ServoLoop servo{drive, servo_ns};
  double angle_rad = 0.3;
  std::int64_t time_ns = 0;

  Setpoints() {
    servo.reset(angle_rad, 0.0);
    servo.enable(0);
    step();
  }
  void step() {
    time_ns += servo_ns;
    servo.update(angle_rad, time_ns);
    angle_rad += servo.following_error_rad();
  }
  [[nodiscard]] std::int32_t counts(double joint_rad) const {
    return static_cast<std::int32_t>(std::lround(joint_rad * drive.counts_per_rad())) + drive.offset_counts;
  }
};

TEST(ServoLoop, CountsTheEncoderWithDirectionAndOffset) {
  const Setpoints s;
  EXPECT_EQ(s.servo.position_counts(), s.counts(0.3));
  EXPECT_LT(s.drive.counts_per_rad(), 0.0);
}

TEST(ServoLoop, ReachesATargetOnePeriodAfterItsSyncOnAStraightLine) {
  Setpoints s;
  s.time_ns = 10 * ms;
  const std::int32_t from = s.servo.demand_counts(), to = from + 4000;
  s.servo.set_target(to, 10 * ms);
  for (int quarter = 1; quarter <= 4; ++quarter) {
    s.step();
    EXPECT_NEAR(s.servo.demand_counts(), from + 1000 * quarter, 1) << quarter;
  }
  EXPECT_EQ(s.servo.demand_counts(), to);
}

TEST(ServoLoop, ReachesTheTargetInTimeAlsoAfterALateSync) {
  Setpoints s;
  s.time_ns = 10 * ms;
  std::int32_t target = s.servo.demand_counts();
  for (int k = 0; k < 10; ++k) {
    const std::int64_t late = k == 5 ? 135'000 : 0;  // held back by one frame at 1 Mbit/s
    s.servo.set_target(target += 1000, (10 + k) * ms + late);
    for (int quarter = 0; quarter < 4; ++quarter) s.step();
    if (k != 5) {
      EXPECT_EQ(s.servo.demand_counts(), target) << k;
    }
  }
}

TEST(ServoLoop, DeceleratesWithinItsLimitWhenTargetsStopComing) {
  Setpoints s;
  s.time_ns = 10 * ms;
  const double speed = 0.5;  // rad/s
  double target = 0.3;
  std::int64_t sync = 10 * ms;
  for (int k = 0; k < 20; ++k, sync += ms) {
    s.servo.set_target(s.counts(target += speed * 1e-3), sync);
    for (int quarter = 0; quarter < 4; ++quarter) s.step();
  }
  double last = s.angle_rad, last_speed = speed;
  int steps = 0;
  for (; !s.servo.at_rest() && steps < 10000; ++steps) {
    s.step();
    const double now_speed = (s.angle_rad - last) / 0.25e-3;
    // Two counts of 2.5e7 per rad in 0.25 ms are 3.2e-4 rad/s
    EXPECT_LE(std::abs(now_speed - last_speed), s.drive.max_acceleration_rad_per_s2 * 0.25e-3 + 4e-4);
    last = s.angle_rad;
    last_speed = now_speed;
  }
  EXPECT_LT(steps, 200);
  // v²/2a, and a quarter of a period of patience
  const double way = speed * speed / (2.0 * s.drive.max_acceleration_rad_per_s2) + 0.25e-3 * speed;
  EXPECT_NEAR(s.angle_rad, target + way, 2e-6);  // 4e-5 rad/s of whole counts, on v/a
  const double rest = s.angle_rad;
  for (int k = 0; k < 100; ++k) s.step();
  EXPECT_NEAR(s.angle_rad, rest, 1e-7);
}

TEST(ServoLoop, StopsWithTheDecelerationAskedForAndTakesTargetsAgain) {
  Setpoints s;
  s.time_ns = 10 * ms;
  double target = 0.3;
  std::int64_t sync = 10 * ms;
  for (int k = 0; k < 20; ++k, sync += ms) {
    s.servo.set_target(s.counts(target += 0.2e-3), sync);
    for (int quarter = 0; quarter < 4; ++quarter) s.step();
  }
  s.servo.stop(2.0, sync);       // 0.2 rad/s: 0.1 s, 0.01 rad
  s.servo.stop(2.0, sync + ms);  // once more changes nothing
  for (int k = 0; k < 450; ++k) s.step();
  EXPECT_TRUE(s.servo.at_rest());
  // Targets are whole counts of 4e-8 rad: 4e-5 rad/s over a period, and v dv/a = 4e-6 rad on the way
  EXPECT_NEAR(s.angle_rad, target + 0.01, 4e-6);
  const double rest = s.angle_rad;
  s.servo.set_target(s.counts(rest), s.time_ns);
  for (int k = 0; k < 4; ++k) s.step();
  EXPECT_NEAR(s.angle_rad, rest, 1e-7);
}

TEST(ServoLoop, FollowsNoFasterThanTheDrivesTopSpeedAndSaysSo) {
  Setpoints s;
  s.time_ns = 10 * ms;
  const double start = s.angle_rad;
  s.servo.set_target(s.counts(start + 1.0), 10 * ms);
  for (int quarter = 0; quarter < 4; ++quarter) s.step();
  EXPECT_NEAR(s.angle_rad - start, s.drive.max_speed_rad_per_s * 1e-3, 1e-6);
  EXPECT_TRUE(s.servo.limited());
}

TEST(ServoLoop, GivesNoTorqueAndIgnoresTargetsWithoutPower) {
  Setpoints s;
  s.servo.disable();
  s.servo.set_target(s.counts(1.0), s.time_ns);
  for (int k = 0; k < 10; ++k) {
    EXPECT_EQ(s.servo.update(s.angle_rad, s.time_ns += servo_ns), 0.0);
    EXPECT_EQ(s.servo.demand_counts(), s.servo.position_counts());
  }
}

TEST(ServoLoop, KeepsItsTorqueWithinTheCurrentLimitAndRecoversAtOnce) {
  Setpoints s;
  const double hold = s.angle_rad;
  for (int k = 0; k < 400; ++k) {  // someone forces the rotor 0.1 rad away, for 0.1 s
    const double torque = s.servo.update(hold + 0.1, s.time_ns += servo_ns);
    EXPECT_LE(std::abs(torque), s.drive.simulation.max_torque_Nm);
    EXPECT_EQ(torque, -s.drive.simulation.max_torque_Nm);
    EXPECT_TRUE(s.servo.limited());
  }
  s.servo.update(hold, s.time_ns += servo_ns);
  const double after = s.servo.update(hold, s.time_ns += servo_ns);
  EXPECT_LT(std::abs(after), 0.2 * s.drive.simulation.max_torque_Nm);  // the integral didn't wind up
}

TEST(ServoLoop, PassesATorqueTargetThroughAndTakesPositionControlOverWithoutABump) {
  Setpoints s;
  s.servo.set_torque_Nm(80.0);
  EXPECT_EQ(s.servo.update(s.angle_rad, s.time_ns += servo_ns), 80.0);
  s.servo.set_torque_Nm(1e6);
  EXPECT_EQ(s.servo.update(s.angle_rad, s.time_ns += servo_ns), s.drive.simulation.max_torque_Nm);
  s.servo.set_torque_Nm(80.0);
  s.servo.update(s.angle_rad, s.time_ns += servo_ns);
  s.servo.stop(10.0, s.time_ns);
  EXPECT_NEAR(s.servo.update(s.angle_rad, s.time_ns += servo_ns), 80.0, 1e-9);
}

TEST(ServoLoop, StaysFiniteOnExtremeTargets) {
  Setpoints s;
  for (const std::int32_t target : {std::int32_t{2147483647}, std::int32_t{-2147483647 - 1}, 0}) {
    s.servo.set_target(target, s.time_ns);
    for (int k = 0; k < 10; ++k) {
      s.step();
      EXPECT_TRUE(std::isfinite(s.servo.torque_Nm()));
    }
  }
}

}  // namespace
}  // namespace proxarm::sim
