#include "controller/motion/measurement.hpp"

#include <gtest/gtest.h>

#include "tests/controller/motion/fake_devices.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using testing::FakeDrives;
using testing::FakeSensor;

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
  EXPECT_EQ(measurement.now().unheard_cycles[2], 2.0) << "before this one";
  EXPECT_EQ(measurement.now().fresh, 0b111111);
  measurement.take();
  EXPECT_EQ(measurement.now().unheard_cycles[2], 0.0);
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

TEST_F(MeasurementTest, CountsInTheNewTimestep) {
  drives[0].angle_rad += 1e-3;
  drives[3].is_fresh = false;
  measurement.take();
  measurement.set_period(2e-3);
  EXPECT_NEAR(measurement.now().moved_rad[0], 2e-3, 1e-15) << "at the same speed";
  drives[3].is_fresh = true;
  measurement.take();
  EXPECT_EQ(measurement.now().unheard_cycles[3], 0.5);
}

}  // namespace
}  // namespace proxarm::controller
