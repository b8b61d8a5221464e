// One CiA 402 drive in cyclic synchronous torque mode: bytes in, bytes out, from the mapping {6041, 6064, 6077} /
// {6040, 6071}, numbers little-endian, torques in thousandths of the rated one (6076h).
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "fieldbus/cia402/cia402_drive.hpp"
#include "models/base/setup_error.hpp"
#include "tests/fieldbus/can/scripted_network.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::int64_t ms = 1'000'000;

// 1000 counts per radian, a motor of 0.5 Nm behind a gear of 10 : 1 that turns the other way round.
description::DriveDescription torque_drive() {
  description::DriveDescription drive;
  drive.joint = "elbow";
  drive.bus = "axes";
  drive.node = 3;
  drive.mode = "cst";
  drive.counts_per_motor_revolution = 200.0 * std::numbers::pi;
  drive.gear_ratio = 10.0;
  drive.direction = -1;
  drive.range_rad = {-3.0, 3.0};
  drive.max_speed_rad_per_s = std::numbers::pi;
  drive.max_acceleration_rad_per_s2 = 20.0;
  drive.rated_torque_Nm = 5.0;
  drive.max_torque_Nm = 7.5;
  return drive;
}

struct Cia402TorqueTest : ::testing::Test {
  ServoDrive drive{torque_drive(), DriveSettings{}};
  std::int64_t now_ns = 0;

  std::string cycle(const std::string& tpdo) {
    now_ns += ms;
    drive.on_sync(now_ns);
    EXPECT_TRUE(drive.on_frame(frame_of(tpdo), now_ns + 100'000));
    CanFrame rpdo;
    return drive.encode_rpdo(rpdo) ? text_of(rpdo) : "";
  }
  [[nodiscard]] const SdoStep* find(std::uint16_t index, std::uint8_t sub) const {
    for (const SdoStep& step : steps) {
      if (step.object.index == index && step.object.sub == sub && step.kind != SdoStep::Kind::read) return &step;
    }
    return nullptr;
  }
  std::vector<SdoStep> steps = drive.configuration_steps();
};

// The brake is closed until the drive follows (statusword bit 12): the torque that holds the axis then must be there
// before.
TEST_F(Cia402TorqueTest, SendsTheTorqueAlsoBeforeTheDriveFollows) {
  drive.start_cycle(now_ns);
  drive.request(DriveGoal::operation_enabled);
  EXPECT_TRUE(drive.set_target_torque_Nm(1.0));
  EXPECT_EQ(cycle("183#5002640000000000"), "203#060038FF");  // −200 = FF38h
  cycle("183#3102640000000000");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(cycle("183#3302640000000000"), "203#070038FF");
  EXPECT_EQ(cycle("183#3302640000000000"), "203#0F0038FF");
  cycle("183#3712640000000000");
  EXPECT_TRUE(drive.following());
  EXPECT_TRUE(drive.set_target_torque_Nm(-7.5));
  EXPECT_EQ(cycle("183#371264000000A2FE"), "203#0F00DC05");  // 1500; the drive says −350
  EXPECT_EQ(drive.target_torque(), 1500);
  EXPECT_EQ(drive.actual_torque(), -350);
  EXPECT_DOUBLE_EQ(drive.actual_torque_Nm(), 1.75);
  EXPECT_EQ(drive.actual_counts(), 100);
  EXPECT_EQ(drive.fault(), DriveFault::none);
}

TEST_F(Cia402TorqueTest, RefusesATorqueThatIsNone) {
  for (const double torque_Nm : {std::numeric_limits<double>::quiet_NaN(), 1e6}) {
    ServoDrive other(torque_drive(), DriveSettings{});
    other.set_target_torque_Nm(1.0);
    EXPECT_FALSE(other.set_target_torque_Nm(torque_Nm));
    EXPECT_EQ(other.fault(), DriveFault::target_out_of_range);
    EXPECT_EQ(other.target_torque(), -200) << "the one before stands";
  }
}

TEST_F(Cia402TorqueTest, TakesATpdoWithoutTheTorqueAsShort) {
  drive.start_cycle(now_ns);
  cycle("183#371264000000");
  EXPECT_EQ(drive.fault(), DriveFault::pdo_short);
}

TEST_F(Cia402TorqueTest, ConfiguresModeMappingLimitsAndTheTimerThatEndsATorque) {
  EXPECT_EQ(find(0x6060, 0)->value, 10u);
  EXPECT_EQ(find(0x6502, 0)->value, 1u << 9);
  EXPECT_EQ(find(0x1600, 2)->value, 0x60710010u);
  EXPECT_EQ(find(0x1A00, 3)->value, 0x60770010u);
  EXPECT_EQ(find(0x1400, 5)->value, 3u);  // ms: three periods
  EXPECT_EQ(find(0x6007, 0)->value, 3u);  // quick stop
  EXPECT_EQ(find(0x6072, 0)->value, 1500u);
  EXPECT_EQ(find(0x6076, 0)->value, 500u);  // mNm at the motor
  EXPECT_EQ(find(0x6080, 0)->value, 300u);  // π rad/s · 10 = 300 / min
}

TEST_F(Cia402TorqueTest, RefusesWhatCantBeHeldWithinThreePeriods) {
  DriveSettings settings;
  settings.period_ns = 250'000;  // three of them are less than the timer's millisecond
  EXPECT_THROW(ServoDrive(torque_drive(), settings), description::SetupError);
  settings.period_ns = 500'000;
  const std::vector<SdoStep> steps_500us = ServoDrive(torque_drive(), settings).configuration_steps();
  EXPECT_TRUE(std::any_of(steps_500us.begin(), steps_500us.end(), [](const SdoStep& s) {
    return s.object.index == 0x1400 && s.object.sub == 5 && s.value == 1;
  })) << "1.5 ms, rounded down";
}

TEST_F(Cia402TorqueTest, TakesObjectsThatTheDriveHasElsewhere) {
  description::DriveDescription description = torque_drive();
  description.objects.target = 0x230104;
  description.objects.mode = 0x230200;
  steps = ServoDrive(description, DriveSettings{}).configuration_steps();
  EXPECT_EQ(find(0x1600, 2)->value, 0x23010410u);
  EXPECT_EQ(find(0x2302, 0)->value, 10u);
  EXPECT_EQ(find(0x6060, 0), nullptr);
}

}  // namespace
}  // namespace proxarm::fieldbus
