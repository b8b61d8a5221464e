#include "sim/physics/plant.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <complex>
#include <iostream>
#include <memory>

#include "models/base/setup_error.hpp"
#include "tests/sim/cell/default_cell.hpp"

namespace proxarm::sim {
namespace {

using models::Vec3;
constexpr std::int64_t ms = 1'000'000;

// A hand that pulls with a constant force: soft and far away.
description::HandDescription pull(const Vec3& force_N, double mass_kg = 1.0) {
  description::HandDescription hand;
  hand.mass_kg = mass_kg;
  hand.stiffness_N_per_m = 1e-3;
  hand.damping_Ns_per_m = 0.0;
  const Vec3 away = force_N / hand.stiffness_N_per_m;
  hand.waypoints = {{0.0, {0.0, 0.0, 0.0}}, {0.2, {away.x(), away.y(), away.z()}}};
  return hand;
}

struct DefaultPlant : Plant {
  explicit DefaultPlant(const description::HandDescription& hand = no_hand(),
                        const description::Cell& cell = default_cell(), const PlantConfig& config = {})
      : Plant(cell, default_sensor(), hand, 0, config) {}
  void enable_all() {
    for (std::size_t i = 0; i < axis_count(); ++i) servo(i).enable(time_ns());
  }
  [[nodiscard]] Vec3 position() const { return tool().X_WT.translation(); }
};

TEST(Plant, StandsStillWithClosedBrakesBitForBit) {
  DefaultPlant plant;
  std::vector<double> start;
  for (std::size_t i = 0; i < 6; ++i) start.push_back(plant.arm().motor_angle_rad(i));
  plant.advance_to(1000 * ms);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(plant.arm().motor_angle_rad(i), start[i]);
}

// Brakes open onto a torque that carries the arm: no drop, no jump.
TEST(Plant, DoesNotJumpWhenTheDrivesAreEnabled) {
  DefaultPlant plant;
  plant.advance_to(100 * ms);
  const Vec3 start = plant.position();
  plant.enable_all();
  double worst = 0.0;
  for (int k = 101; k < 1000; ++k) {
    plant.advance_to(k * ms);
    worst = std::max(worst, (plant.position() - start).norm());
  }
  std::cout << "the tool moves by " << worst * 1e6 << " um when the drives are enabled\n";
  EXPECT_LT(worst, 1e-6);  // some counts of 40 nrad, at 0.7 m
}

TEST(Plant, DoesNotJumpWhenAnEnabledDriveIsDisabledAndEnabledAgain) {
  DefaultPlant plant;
  plant.enable_all();
  plant.advance_to(100 * ms);
  const Vec3 start = plant.position();
  for (std::size_t i = 0; i < 6; ++i) plant.servo(i).disable();
  plant.advance_to(200 * ms);
  plant.enable_all();
  plant.advance_to(600 * ms);
  EXPECT_LT((plant.position() - start).norm(), 1e-6);
}

// 10 N at the handle bend the gears; the drives hold. This is the floor of what the tool enters a wall.
TEST(Plant, YieldsLessThanATenthOfAMillimetreTo10N) {
  for (int direction = 0; direction < 3; ++direction) {
    DefaultPlant plant(pull(10.0 * Vec3::Unit(direction)));
    const Vec3 start = plant.position();
    plant.enable_all();
    plant.advance_to(3000 * ms);
    const Vec3 moved = plant.position() - start;
    std::cout << "10 N along axis " << direction << " of W: " << moved.transpose() * 1e6 << " um\n";
    EXPECT_GT(moved[direction], 10e-6);
    EXPECT_LT(moved.norm(), 100e-6);
  }
}

// A step of 0.1 mrad on each axis: there within 20 ms, little overshoot, no error left.
TEST(Plant, FollowsAStepOnEveryAxis) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    DefaultPlant plant;
    const auto cell = default_cell();
    plant.enable_all();
    plant.advance_to(10 * ms);
    const double step = 1e-4, start = plant.arm().motor_angle_rad(axis);
    const std::int32_t target =
        plant.servo(axis).position_counts() + static_cast<std::int32_t>(step * cell.drives[axis].counts_per_rad());
    double highest = 0.0;
    for (int k = 10; k < 400; ++k) {
      plant.servo(axis).set_target(target, k * ms);
      plant.advance_to((k + 1) * ms);
      const double way = plant.arm().motor_angle_rad(axis) - start;
      highest = std::max(highest, way);
      if (k > 40) {
        EXPECT_NEAR(way, step, 0.1 * step) << "axis " << axis + 1 << " at " << k << " ms";
      }
    }
    EXPECT_LT(highest, 1.4 * step) << "axis " << axis + 1;
    EXPECT_NEAR(plant.arm().motor_angle_rad(axis) - start, step, 2e-7) << "axis " << axis + 1;  // a few counts
  }
}

// Bandwidth of motor against interpolated setpoint, by sines of one axis; friction included.
TEST(Plant, FollowsSinesUpTo100HzWithALagBelow2Ms) {
  const auto cell = default_cell();
  for (const std::size_t axis : {0u, 1u, 4u}) {
    for (const double frequency : {5.0, 20.0, 50.0, 100.0}) {
      DefaultPlant plant;
      plant.enable_all();
      plant.advance_to(1 * ms);
      const double amplitude = 20e-6 + 2e-3 / frequency / frequency, start = plant.arm().motor_angle_rad(axis);
      const std::int32_t origin = plant.servo(axis).position_counts();
      std::complex<double> in = 0.0, out = 0.0;
      for (int k = 1; k <= 1000; ++k) {
        const double reached_s = 1e-3 * (k + 1);
        const double target = amplitude * std::sin(2.0 * M_PI * frequency * reached_s);
        plant.servo(axis).set_target(
            origin + static_cast<std::int32_t>(std::lround(target * cell.drives[axis].counts_per_rad())), k * ms);
        plant.advance_to((k + 1) * ms);
        if (k < 600) continue;  // 400 ms are whole periods of all frequencies
        const auto turn = std::polar(1.0, -2.0 * M_PI * frequency * reached_s);
        in += target * turn;
        out += (plant.arm().motor_angle_rad(axis) - start) * turn;
      }
      const std::complex<double> response = out / in;
      const double lag_s = -std::arg(response) / (2.0 * M_PI * frequency);
      std::cout << "axis " << axis + 1 << ", " << frequency << " Hz: gain " << std::abs(response) << ", lag "
                << lag_s * 1e3 << " ms\n";
      EXPECT_GT(std::abs(response), std::sqrt(0.5));
      EXPECT_LT(std::abs(response), 1.2);
      EXPECT_LT(std::abs(lag_s), 2e-3);
    }
  }
}

// The servo loops must not stir up the arm's elastic modes: a knock dies away with at least 3 % of critical damping.
TEST(Plant, DampsTheArmsModesByAtLeastThreePercent) {
  for (int direction = 0; direction < 3; ++direction) {
    DefaultPlant plant;
    plant.enable_all();
    plant.advance_to(100 * ms);
    const Vec3 start = plant.position();
    ArmDynamics& arm = plant.arm();
    std::int64_t time_ns = plant.time_ns();
    std::vector<double> torque(6), peaks;
    double before = 0.0, before2 = 0.0;
    for (int k = 0; k < 3200; ++k) {  // 0.8 s
      arm.advance();
      time_ns += 250'000;
      for (std::size_t i = 0; i < 6; ++i) torque[i] = plant.servo(i).update(arm.motor_angle_rad(i), time_ns);
      arm.apply(torque, k < 40 ? Vec3(100.0 * Vec3::Unit(direction)) : Vec3(Vec3::Zero()));
      const double way = arm.tool().X_WT.translation()[direction] - start[direction];
      if (k > 60 && before > before2 && before > way) peaks.push_back(before);
      before2 = before;
      before = way;
    }
    ASSERT_GE(peaks.size(), 6u);
    // ln(x₁/x_{n+1}) = 2π n ζ/√(1 − ζ²)
    const double n = static_cast<double>(peaks.size() - 1), decrement = std::log(peaks.front() / peaks.back()) / n;
    const double damping = decrement / std::hypot(2.0 * M_PI, decrement);
    std::cout << "a knock along axis " << direction << " of W: damping " << 100.0 * damping << " % over " << n
              << " periods\n";
    EXPECT_GT(damping, 0.03);
  }
}

TEST(Plant, StaysQuietAtRest) {
  DefaultPlant plant;
  plant.enable_all();
  plant.advance_to(500 * ms);
  const Vec3 start = plant.position();
  double worst = 0.0, fastest = 0.0;
  for (int k = 500; k < 2500; ++k) {
    plant.advance_to(k * ms);
    worst = std::max(worst, (plant.position() - start).norm());
    fastest = std::max(fastest, plant.tool().velocity_W.norm());
  }
  std::cout << "at rest the tool wanders by " << worst * 1e9 << " nm, at up to " << fastest * 1e6 << " um/s\n";
  EXPECT_LT(worst, 1e-6);
}

// A drive that turns slowly takes the ripple of its motor off by its own torque, which is there to be read (6077h).
TEST(Plant, ADrivesTorqueHasTheRippleThatTheCellSays) {
  description::Cell cell = default_cell();
  description::DriveDescription& drive = cell.drives[0];
  constexpr double ripple_Nm = 30.0, speed_rad_per_s = 0.02;
  drive.simulation.torque_ripple_Nm = ripple_Nm;
  drive.simulation.torque_ripple_per_revolution = 3;
  DefaultPlant plant(no_hand(), cell);
  plant.enable_all();
  const double per_rad = 3.0 * drive.gear_ratio, start_rad = plant.arm().motor_angle_rad(0);
  const double counts_per_rad = drive.counts_per_motor_revolution * drive.gear_ratio * drive.direction / (2.0 * M_PI);
  std::complex<double> sum = 0.0;
  int count = 0;
  const int whole_periods = static_cast<int>(speed_rad_per_s * 4.0 * per_rad / (2.0 * M_PI));
  for (int k = 1; k <= 6000; ++k) {
    const double target_rad = start_rad + speed_rad_per_s * 1e-3 * k;
    plant.servo(0).set_target(static_cast<std::int32_t>(std::lround(target_rad * counts_per_rad + drive.offset_counts)),
                              plant.time_ns());
    plant.advance_to(k * ms);
    const double angle_rad = plant.arm().motor_angle_rad(0), from_rad = start_rad + speed_rad_per_s;
    if (angle_rad < from_rad || angle_rad >= from_rad + whole_periods * 2.0 * M_PI / per_rad) continue;
    sum += plant.servo(0).torque_Nm() * std::polar(1.0, -per_rad * angle_rad);
    ++count;
  }
  ASSERT_GT(count, 2000);
  // −A sin(φ) against exp(−iφ): i A/2 in the mean. 5 %: quantised speeds, and friction that isn't the same everywhere.
  EXPECT_NEAR(2.0 * (sum / static_cast<double>(count)).imag(), ripple_Nm, 0.05 * ripple_Nm);
  EXPECT_NEAR(2.0 * (sum / static_cast<double>(count)).real(), 0.0, 0.05 * ripple_Nm);
}

TEST(Plant, HoldsAJammedAxisStillWhileItsServoPushes) {
  DefaultPlant plant;
  plant.enable_all();
  plant.advance_to(10 * ms);
  plant.arm().jam(0, true);
  const double start = plant.arm().motor_angle_rad(0);
  const std::int32_t origin = plant.servo(0).position_counts();
  for (int k = 10; k < 500; ++k) {
    plant.servo(0).set_target(origin + 10000 * (k - 9), k * ms);
    plant.advance_to((k + 1) * ms);
    ASSERT_EQ(plant.arm().motor_angle_rad(0), start);
  }
  EXPECT_GT(std::abs(plant.servo(0).following_error_rad()), 0.1);
  EXPECT_TRUE(plant.servo(0).limited());
}

TEST(Plant, StartsTheHandWhenAllDrivesAreEnabled) {
  DefaultPlant plant(pull(Vec3(5.0, 0.0, 0.0)));
  plant.advance_to(300 * ms);
  EXPECT_FALSE(plant.hand_started());
  EXPECT_LT(plant.handle_force_W().norm(), 1e-6);
  plant.servo(0).enable(300 * ms);
  plant.advance_to(400 * ms);
  EXPECT_FALSE(plant.hand_started());
  plant.enable_all();
  plant.advance_to(401 * ms);
  EXPECT_TRUE(plant.hand_started());
  EXPECT_GE(plant.hand_start_ns(), 400 * ms);
  plant.advance_to(1500 * ms);
  EXPECT_NEAR(plant.handle_force_W().x(), 5.0, 0.05);
}

TEST(Plant, LivesByAnyClocksZero) {
  const std::int64_t zero = 123'456'789'012'345;
  Plant plant(default_cell(), default_sensor(), no_hand(), zero);
  plant.advance_to(zero + 249'999);
  EXPECT_EQ(plant.time_ns(), zero);
  plant.advance_to(zero + 250'000);
  EXPECT_EQ(plant.time_ns(), zero + 250'000);
  plant.advance_to(zero);  // never back
  EXPECT_EQ(plant.time_ns(), zero + 250'000);
  const GaugeSample sample = plant.force_sensor().sample(zero + 300'000);
  EXPECT_LE(sample.time_ns, zero + 300'000);
  EXPECT_GT(sample.time_ns, zero + 150'000);
}

TEST(Plant, RefusesServoRatesThatDoNotFitTogether) {
  auto cell = default_cell();
  cell.drives[3].simulation.servo_rate_Hz = 3000.0;
  EXPECT_THROW(Plant(cell, default_sensor(), no_hand()), description::SetupError);
  cell.drives[3].simulation.servo_rate_Hz = 8000.0;
  const Plant plant(cell, default_sensor(), no_hand());
  EXPECT_EQ(plant.step_ns(), 125'000);
}

// A whole second of touch.yaml's motion on held axes; every number twice the same.
std::vector<double> fingerprint() {
  DefaultPlant plant(description::load_hand(source_file("sim/hands/touch.yaml")));
  plant.enable_all();
  std::vector<double> all;
  for (int k = 1; k <= 3000; ++k) {
    for (std::size_t i = 0; i < 6; ++i)
      plant.servo(i).set_target(plant.servo(i).demand_counts() + (k % 50) - 25, k * ms);
    plant.advance_to((k + 1) * ms);
    for (int i = 0; i < 3; ++i) all.push_back(plant.position()[i]);
    for (const auto gauge : plant.force_sensor().sample(plant.time_ns()).gauges) all.push_back(gauge);
  }
  return all;
}

TEST(Plant, GivesTheSameBitsTwice) { EXPECT_EQ(fingerprint(), fingerprint()); }

TEST(Plant, ReportsHowLong10SecondsTake) {
  DefaultPlant plant(description::load_hand(source_file("sim/hands/touch.yaml")));
  plant.enable_all();
  const auto start = std::chrono::steady_clock::now();
  for (int k = 1; k <= 10000; ++k) {
    for (std::size_t i = 0; i < 6; ++i) plant.servo(i).set_target(plant.servo(i).demand_counts(), k * ms);
    plant.advance_to((k + 1) * ms);
    EXPECT_FALSE(plant.force_sensor().sample(plant.time_ns()).saturated);
  }
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  std::cout << "10 s of mechanics, servo loops, sensor and hand: " << taken.count() << " s, "
            << taken.count() * 1e6 / 40000 << " us per step\n";
}

// A brake of limited torque, alone on a rotor that turns without power: J ω̇ = −(brake + Coulomb friction).
TEST(Plant, ABrakeOfLimitedTorqueLetsTheRotorRunOut) {
  description::Cell cell = default_cell();
  constexpr double torque_Nm = 300.0, delay_s = 0.05;
  for (description::DriveDescription& drive : cell.drives) {
    drive.simulation.brake_torque_Nm = 20.0 * torque_Nm;  // holds the weight
    drive.simulation.brake_delay_s = delay_s;
  }
  description::SimulatedDrive& first = cell.drives[0].simulation;
  first.brake_torque_Nm = torque_Nm;
  const auto run_out = [&](double brake_delay_s) {
    first.brake_delay_s = brake_delay_s;
    DefaultPlant plant(no_hand(), cell);
    plant.enable_all();
    // The vertical axis is led up to 0.5 rad/s: along it there is no weight.
    const double counts_per_rad = cell.drives[0].counts_per_rad();
    for (int k = 0; k < 500; ++k) {
      const double t = 1e-3 * k;
      plant.servo(0).set_target(static_cast<std::int32_t>(std::lround(0.5 * t * t * counts_per_rad)), k * ms);
      plant.advance_to((k + 1) * ms);
    }
    for (std::size_t i = 0; i < plant.axis_count(); ++i) plant.servo(i).disable();
    const double from = plant.arm().motor_angle_rad(0);
    plant.advance_to(3000 * ms);
    EXPECT_EQ(plant.arm().motor_speed_rad_per_s(0), 0.0);
    return plant.arm().motor_angle_rad(0) - from;
  };
  const double at_once = run_out(0.0), late = run_out(delay_s);
  // ω²J/2τ, with J of rotor and arm about the vertical axis: 58 kg m² of the rotor alone is the least.
  EXPECT_GT(at_once, 0.5 * 58.0 * 0.25 / (torque_Nm + 25.0));
  EXPECT_LT(at_once, 0.5 * 160.0 * 0.25 / torque_Nm);
  // The delay adds ω t, less what friction takes of ω in t.
  EXPECT_NEAR(late - at_once, 0.5 * delay_s, 0.15 * 0.5 * delay_s);
}

// A drive that rests holds its axis until the brake has closed; one without power lets it sink meanwhile.
TEST(Plant, ADriveThatIsSwitchedOffAtRestHoldsUntilItsBrakeHasClosed) {
  description::Cell cell = default_cell();
  for (description::DriveDescription& drive : cell.drives) {
    drive.simulation.brake_torque_Nm = drive.simulation.max_torque_Nm;
    drive.simulation.brake_delay_s = 0.1;
  }
  const auto sinks_m = [&](bool switched_off) {
    DefaultPlant plant(no_hand(), cell);
    plant.enable_all();
    plant.advance_to(100 * ms);
    const double from_m = plant.position().z();
    for (std::size_t i = 0; i < plant.axis_count(); ++i) {
      if (switched_off) {
        plant.switch_off(i);
      } else {
        plant.servo(i).disable();
      }
    }
    plant.advance_to(1000 * ms);
    for (std::size_t i = 0; i < plant.axis_count(); ++i) EXPECT_TRUE(plant.arm().braked(i));
    return from_m - plant.position().z();
  };
  EXPECT_LT(std::abs(sinks_m(true)), 1e-5);
  EXPECT_GT(sinks_m(false), 2e-3);
}

// The tool comes to rest where spring and pull balance; the sensor feels a body that the handle presses, and not one
// that the arm presses.
TEST(Plant, ABodyInTheWayPressesOnTheHandleOrOnTheArm) {
  for (const bool felt : {true, false}) {
    DefaultPlant plant;
    plant.enable_all();
    plant.advance_to(200 * ms);
    const models::Wrench before = plant.arm().sensor_wrench_S();
    const Vec3 start = plant.position();
    // It reaches a millimetre over the tool from the front: the arm gives way a little.
    plant.set_clamp({start - 1e-3 * Vec3::UnitX(), Vec3::UnitX(), 50e3, felt});
    plant.advance_to(3000 * ms);
    const double depth = 1e-3 + (plant.position() - start).x();
    EXPECT_GT(depth, 0.5e-3);
    EXPECT_LT(plant.position().x(), start.x());
    // x of S is -x of W: a push along -x of W reads +x.
    const double read_N = plant.arm().sensor_wrench_S().force.x() - before.force.x();
    EXPECT_NEAR(read_N, felt ? 50e3 * depth : 0.0, 0.5) << (felt ? "felt" : "unfelt");
  }
}

}  // namespace
}  // namespace proxarm::sim
