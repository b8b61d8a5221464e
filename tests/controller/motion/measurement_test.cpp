#include "controller/motion/measurement.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/controller/motion/fake_devices.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using testing::FakeDrives;
using testing::FakeSensor;
using testing::Watched;

struct MeasurementTest : ::testing::Test {
  description::Cell cell = testing::default_cell();
  models::Arm arm{cell};
  FakeDrives drives{cell, arm};
  FakeSensor sensor;
  Measurement measurement{drives.on_bus, sensor, arm, WrenchCompensation(cell), 1e-3};
};

TEST_F(MeasurementTest, TakesTheTwistOfTheGearsOffTheEncoders) {
  const JointVector link_rad = arm.start_rad(), motor_rad = arm.motor_from_link(link_rad);
  for (std::size_t i = 0; i < 6; ++i) drives[i].angle_rad = motor_rad[static_cast<Eigen::Index>(i)];
  for (int k = 0; k < 20; ++k) measurement.take();
  EXPECT_LT((measurement.now().link_rad - link_rad).norm(), 1e-12);
  EXPECT_LT((measurement.now().tool_W - arm.tool_pose(link_rad).translation()).norm(), 1e-12);
}

TEST_F(MeasurementTest, AveragesSpeedOverTwoPeriodsOfFeedback) {
  drives[0].answers_every_s = 0.0;
  drives[1].answers_every_s = 4.5e-3;  // a share of 1/10 of each cycle's way
  measurement.take();
  drives[0].angle_rad += 1e-3;
  drives[1].angle_rad += 1e-3;
  measurement.take();
  EXPECT_NEAR(measurement.now().moved_rad[0], 1e-3, 1e-15);
  EXPECT_NEAR(measurement.now().moved_rad[1], 1e-4, 1e-15);
  EXPECT_NEAR(measurement.now().jump_rad[1], 1e-3, 1e-15);
}

TEST_F(MeasurementTest, CountsTheCyclesWithoutAnAnswer) {
  drives[2].is_fresh = false;
  measurement.take();
  measurement.take();
  EXPECT_EQ(measurement.now().fresh, 0b111011);
  drives[2].is_fresh = true;
  measurement.take();
  EXPECT_EQ(measurement.now().answers.unheard_cycles[2], 2.0) << "before this one";
  EXPECT_EQ(measurement.now().fresh, 0b111111);
  measurement.take();
  EXPECT_EQ(measurement.now().answers.unheard_cycles[2], 0.0);
}

TEST_F(MeasurementTest, KeepsTheLastReadingWhereNoneComes) {
  sensor.sample.wrench_S = {1.0, 2.0, 3.0, 0.1, 0.2, 0.3};
  measurement.take();
  EXPECT_TRUE(measurement.now().sample_is_new);
  sensor.is_fresh = false;
  sensor.sample.wrench_S = {};
  measurement.take();
  EXPECT_FALSE(measurement.now().sample_is_new);
  EXPECT_EQ(measurement.now().reading_S.force, models::Vec3(1.0, 2.0, 3.0));
}

TEST_F(MeasurementTest, ReadsNoForceAtRestAfterTaring) {
  sensor.sample.wrench_S = {10.0, -4.0, 3.0, 0.1, 0.2, 0.3};
  for (int k = 0; k < 10; ++k) {
    measurement.take();
    measurement.add_tare_sample();
  }
  EXPECT_GT(measurement.now().hand_W.force.norm(), 1.0);
  measurement.finish_tare();
  EXPECT_LT(measurement.now().hand_W.force.norm(), 1e-6);
  EXPECT_LT(measurement.tare_spread_N(), 1e-6);
}

// The story: only the spread of a tare was judged, so a steady 30 N became the zero, and let go sent the arm off.
TEST_F(MeasurementTest, ATareWhoseMeanIsntTheKnownZeroIsOfAHandUnlessThatMuchIsAccepted) {
  for (const double held_N : {0.0, 2.0, 30.0}) {
    for (const double accepted_N : {3.3, 40.0, std::numeric_limits<double>::infinity()}) {
      Watched watched;
      SessionSettings settings;
      settings.zero_S_N = {10.0, -4.0, 3.0};
      settings.zero_drift_N = accepted_N;
      measurement.take();
      const models::Wrench weight = WrenchCompensation(cell).tool_weight_S(measurement.now().R_WS);
      const models::Vec3 zero_S(settings.zero_S_N.data()),
          reading_S = zero_S + weight.force + models::Vec3(held_N, 0, 0);
      sensor.sample.wrench_S = {reading_S.x(), reading_S.y(), reading_S.z(), 0.0, 0.0, 0.0};
      measurement.start_tare();
      bool tared = false;
      for (int k = 0; k < 300 && !tared; ++k) {
        measurement.take();
        tared = measurement.tare(settings, 1e-3 * k, watched.alarm);
      }
      EXPECT_EQ(tared, held_N <= accepted_N) << held_N << " N, " << accepted_N;
      const FaultReport& report = watched.supervisor.report();
      EXPECT_EQ(report.fault, tared ? Fault::none : Fault::force_at_start);
      if (tared) continue;
      EXPECT_NEAR(report.value, held_N, 1e-9);
      EXPECT_NEAR(models::Vec3(report.force_W_N.data()).norm(), held_N, 1e-9);
    }
  }
}

TEST(StandingForce, IsToldWithItsDirectionAndAlongGravityAsAMass) {
  const std::array<double, 3> gravity{0.0, 0.0, -9.80665};
  const auto told = [&](const std::array<double, 3>& force_W_N) {
    return standing_force_text({.fault = Fault::force_at_start, .force_W_N = force_W_N}, gravity);
  };
  EXPECT_EQ(told({25, 0.1, 0}), "25 N towards +x of W: is somebody holding it, or has the sensor's zero moved?");
  EXPECT_EQ(told({0, 0, -24.6}), "25 N towards -z of W: is somebody holding it, or is the tool heavier by 2.5 kg?");
  EXPECT_EQ(told({0, 0, 9.80665}), "9.8 N towards +z of W: is somebody holding it, or is the tool lighter by 1 kg?");
  EXPECT_EQ(told({6, -8, 0}),
            "10 N towards (0.6, -0.8, 0) of W: is somebody holding it, or has the sensor's zero moved?");
  EXPECT_EQ(told({0, 0, 0}), "");
}

TEST_F(MeasurementTest, CountsInTheNewTimestep) {
  drives[0].angle_rad += 1e-3;
  drives[3].is_fresh = false;
  measurement.take();
  measurement.set_period(2e-3);
  EXPECT_NEAR(measurement.now().moved_rad[0], 2e-3, 1e-15) << "at the same speed";
  drives[3].is_fresh = true;
  measurement.take();
  EXPECT_EQ(measurement.now().answers.unheard_cycles[3], 0.5);
}

}  // namespace
}  // namespace proxarm::controller
