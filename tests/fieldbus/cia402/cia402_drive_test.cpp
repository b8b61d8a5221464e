// One CiA 402 drive in CSP: bytes in, bytes out, units, enabling, faults. Frames are written by hand from the mapping
// {6041, 6064} / {6040, 607A}, numbers little-endian.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <random>

#include "fieldbus/cia402/cia402_drive.hpp"
#include "models/base/setup_error.hpp"
#include "tests/fieldbus/can/scripted_network.hpp"

namespace proxarm::fieldbus {
namespace {

using description::DriveDescription;
using description::SetupError;

constexpr std::int64_t ms = 1'000'000;

// 2π · 1000 counts per motor revolution and no gear: 1000 counts per radian.
DriveDescription thousand_counts_per_rad() {
  DriveDescription drive;
  drive.joint = "axis_3";
  drive.bus = "axes_1_3";
  drive.node = 3;
  drive.counts_per_motor_revolution = 2000.0 * std::numbers::pi;
  drive.gear_ratio = 1.0;
  drive.range_rad = {-3.0, 3.0};
  drive.max_acceleration_rad_per_s2 = 20.0;
  return drive;
}

struct Cia402DriveTest : ::testing::Test {
  ServoDrive drive{thousand_counts_per_rad(), DriveSettings{}};
  std::int64_t now_ns = 0;

  // One cycle: SYNC, the TPDO that answers it, the RPDO that follows; "" where the drive sends none.
  std::string cycle(const std::string& tpdo) {
    now_ns += ms;
    drive.on_sync(now_ns);
    if (!tpdo.empty()) {
      EXPECT_TRUE(drive.on_frame(frame_of(tpdo), now_ns + 100'000));
    }
    CanFrame rpdo;
    return drive.encode_rpdo(rpdo) ? text_of(rpdo) : "";
  }
  void enable() {
    drive.start_cycle(now_ns);
    drive.request(DriveGoal::operation_enabled);
    cycle("183#500200000000");
    cycle("183#310200000000");
    for (int i = 0; i < 4; ++i) cycle("183#330200000000");
    cycle("183#371200000000");
    ASSERT_TRUE(drive.following());
  }
};

TEST_F(Cia402DriveTest, WantsItsOwnFramesOnly) {
  EXPECT_EQ(drive.wanted_ids(), (std::array<std::uint32_t, 4>{0x183, 0x083, 0x583, 0x703}));
  EXPECT_FALSE(drive.on_frame(frame_of("184#370600000000"), 0));
  EXPECT_FALSE(drive.on_frame(frame_of("203#0F0000000000"), 0));
  CanFrame extended = frame_of("183#370600000000");
  extended.extended = true;
  EXPECT_FALSE(drive.on_frame(extended, 0));
  CanFrame error = frame_of("183#370600000000");
  error.error = true;
  EXPECT_FALSE(drive.on_frame(error, 0));
}

// Mapped are 6041h, 6064h and, for the record, 606Ch, 60F4h and 603Fh: 16 bytes. The RPDO keeps its six.
TEST(Cia402FdDrive, HasPdosThatAreCanFdFrames) {
  DriveDescription description = thousand_counts_per_rad();
  description.fd = true;
  description.feedback = {{0x606C00, 32}, {0x60F400, 32}, {0x603F00, 16}};
  ServoDrive drive(description, DriveSettings{});
  std::vector<std::uint32_t> mapped;
  for (const SdoStep& step : drive.configuration_steps()) {
    if (step.object.index == 0x1A00 && step.object.sub > 0) mapped.push_back(step.value);
  }
  EXPECT_EQ(mapped, (std::vector<std::uint32_t>{0x60410010, 0x60640020, 0x606C0020, 0x60F40020, 0x603F0010}));
  CanFrame tpdo;
  tpdo.id = 0x183;
  tpdo.fd = tpdo.bit_rate_switch = true;
  tpdo.length = 16;
  tpdo.data = {0x50, 0x02, 0x64, 0x00, 0x00, 0x00, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0x99, 0xAA};
  drive.on_sync(ms);
  EXPECT_TRUE(drive.on_frame(tpdo, ms));
  EXPECT_EQ(drive.actual_counts(), 100);
  CanFrame rpdo;
  drive.request(DriveGoal::operation_enabled);
  ASSERT_TRUE(drive.encode_rpdo(rpdo));
  EXPECT_EQ(text_of(rpdo), "203#060064000000");
  EXPECT_TRUE(rpdo.fd);
  EXPECT_TRUE(rpdo.bit_rate_switch);
  tpdo.length = 12;
  EXPECT_TRUE(drive.on_frame(tpdo, ms));
  EXPECT_EQ(drive.fault(), DriveFault::pdo_short);
}

TEST_F(Cia402DriveTest, SendsNothingBeforeAPositionIsKnown) { EXPECT_EQ(cycle(""), ""); }

// The whole way up, with a position that sags by a count per cycle: the target follows it until the drive follows us.
TEST_F(Cia402DriveTest, EnablesWithoutAJump) {
  drive.start_cycle(0);
  drive.request(DriveGoal::operation_enabled);
  EXPECT_EQ(cycle("183#500264000000"), "203#060064000000");  // switch on disabled → shutdown, at 100 counts
  EXPECT_EQ(cycle("183#310265000000"), "203#070065000000");  // ready → switch on
  EXPECT_EQ(cycle("183#330266000000"), "203#070066000000");  // switched on: three SYNCs must latch target = actual
  EXPECT_EQ(cycle("183#330267000000"), "203#070067000000");
  EXPECT_EQ(cycle("183#330268000000"), "203#070068000000");
  EXPECT_EQ(cycle("183#330269000000"), "203#0F0069000000");  // → enable operation
  EXPECT_EQ(cycle("183#37026A000000"), "203#0F006A000000");  // enabled, the brake still closed (bit 12 off)
  EXPECT_FALSE(drive.following());
  EXPECT_FALSE(drive.set_target_rad(1.0));
  EXPECT_EQ(cycle("183#37026B000000"), "203#0F006B000000");
  EXPECT_EQ(cycle("183#37126C000000"), "203#0F006B000000");  // it follows: the target stands where it was
  EXPECT_TRUE(drive.following());
  EXPECT_TRUE(drive.set_target_rad(-0.1));
  EXPECT_EQ(cycle("183#37126C000000"), "203#0F009CFFFFFF");  // −100 counts
  EXPECT_EQ(drive.fault(), DriveFault::none);
}

TEST_F(Cia402DriveTest, CountsTheThreeSyncsAnewAfterAStepBack) {
  drive.start_cycle(0);
  drive.request(DriveGoal::operation_enabled);
  cycle("183#330200000000");
  cycle("183#330200000000");
  cycle("183#330200000000");
  EXPECT_EQ(cycle("183#310200000000"), "203#070000000000");
  EXPECT_EQ(cycle("183#330200000000"), "203#070000000000");
  EXPECT_EQ(cycle("183#330200000000"), "203#070000000000");
  EXPECT_EQ(cycle("183#330200000000"), "203#070000000000");
  EXPECT_EQ(cycle("183#330200000000"), "203#0F0000000000");
}

TEST_F(Cia402DriveTest, SwitchesOffStepByStep) {
  enable();
  drive.request(DriveGoal::switched_off);
  EXPECT_EQ(cycle("183#371200000000"), "203#060000000000");
  EXPECT_EQ(cycle("183#310205000000"), "203#000005000000");  // no longer following: the target follows the position
  EXPECT_EQ(cycle("183#500205000000"), "203#000005000000");
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  EXPECT_EQ(drive.fault(), DriveFault::none);
}

TEST_F(Cia402DriveTest, ResetsTheFaultThatItIsFoundIn) {
  drive.start_cycle(0);
  drive.request(DriveGoal::operation_enabled);
  EXPECT_EQ(cycle("183#180200000000"), "203#800000000000");
  EXPECT_EQ(cycle("183#180200000000"), "203#000000000000");
  EXPECT_EQ(cycle("183#180200000000"), "203#800000000000");
  EXPECT_EQ(cycle("183#500200000000"), "203#060000000000");
  EXPECT_EQ(drive.fault(), DriveFault::none);
  EXPECT_EQ(cycle("183#180200000000"), "203#000000000000");  // a new one: kept
  EXPECT_EQ(drive.fault(), DriveFault::state_fault);
}

// Code, error register; which stop the arm.
TEST_F(Cia402DriveTest, AnEmergencyIsAFaultUnlessTheDriveSaysThatItGoesOn) {
  const std::pair<const char*, DriveFault> rows[] = {
      {"083#1042080000000000", DriveFault::emergency},  // temperature
      {"083#1042000000000000", DriveFault::emergency},  // the same with no bit in the register
      {"083#1042", DriveFault::emergency},              // and with no register
      {"083#3081110000000000", DriveFault::emergency},  // heartbeat
      {"083#0081", DriveFault::emergency},              // communication, with no register
      {"083#0081000000000000", DriveFault::none},       // and with a register that says: none
      {"083#2081110000000000", DriveFault::none},       // error passive
      {"083#2082110000000000", DriveFault::none},       // PDO too long
      {"083#01FF000000000000", DriveFault::none},       // the maker's, no error
      {"083#01FF800000000000", DriveFault::emergency},
      {"083#0000000000000000", DriveFault::none}};
  for (const auto& [frame, fault] : rows) {
    drive = ServoDrive(thousand_counts_per_rad(), DriveSettings{});
    enable();
    (void)drive.on_frame(frame_of(frame), now_ns);
    EXPECT_EQ(drive.fault(), fault) << frame;
  }
}

TEST_F(Cia402DriveTest, TwoTpdosAtEachSyncAreTwoDrivesWithOneNode) {
  enable();
  const auto doubled = [this] {
    cycle("183#371200000000");
    (void)drive.on_frame(frame_of("183#371240000000"), now_ns + 200'000);
  };
  for (int i = 0; i < 9; ++i) doubled();
  cycle("183#371200000000");  // a line that doubles frames now and then begins anew
  for (int i = 0; i < 10; ++i) doubled();
  EXPECT_EQ(drive.fault(), DriveFault::none);
  cycle("183#371200000000");
  EXPECT_EQ(drive.fault(), DriveFault::two_nodes);
}

TEST_F(Cia402DriveTest, WatchesItsModeWhereItIsMapped) {
  DriveDescription description = thousand_counts_per_rad();
  description.feedback = {{0x606100, 8}};
  drive = ServoDrive(description, DriveSettings{});
  drive.start_cycle(now_ns);
  drive.request(DriveGoal::operation_enabled);
  cycle("183#50020000000000");
  cycle("183#31020000000000");
  for (int i = 0; i < 4; ++i) cycle("183#33020000000000");
  cycle("183#37120000000000");
  EXPECT_FALSE(drive.following()) << "it is enabled, and shows no mode yet";
  cycle("183#37120000000008");
  EXPECT_TRUE(drive.following());
  EXPECT_EQ(drive.fault(), DriveFault::none);
  cycle("183#37120000000001");
  EXPECT_EQ(drive.fault(), DriveFault::mode_changed);
}

// Behind statusword, position and what the record wants; signed, by the sense that the cell says.
TEST_F(Cia402DriveTest, ReadsTheTorqueOfItsGear) {
  DriveDescription description = thousand_counts_per_rad();
  description.gear_torque = description::GearTorque{.object = 0x203100, .bits = 16, .Nm_per_count = -0.5};
  drive = ServoDrive(description, DriveSettings{});
  std::vector<std::uint32_t> mapped;
  for (const SdoStep& step : drive.configuration_steps()) {
    if (step.object.index == 0x1A00 && step.object.sub > 0) mapped.push_back(step.value);
  }
  EXPECT_EQ(mapped, (std::vector<std::uint32_t>{0x60410010, 0x60640020, 0x20310010}));
  drive.start_cycle(now_ns);
  cycle("183#3712640000009CFF");
  EXPECT_DOUBLE_EQ(drive.gear_torque_Nm().value(), 50.0) << "-100 counts of -0.5 Nm";
  EXPECT_EQ(drive.actual_counts(), 100);
  cycle("183#371264000000");
  EXPECT_EQ(drive.fault(), DriveFault::pdo_short) << "without it, nothing damps what was judged as damped";
  EXPECT_FALSE(ServoDrive(thousand_counts_per_rad(), DriveSettings{}).gear_torque_Nm());
}

TEST(Cia402FdDrive, FindsItsGearsTorqueByASecondEncoder) {
  DriveDescription description = thousand_counts_per_rad();
  description.fd = true;
  description.feedback = {{0x606100, 8}};
  description.gear_stiffness_Nm_per_rad = 1e5;
  const double counts = 1e6 * 2.0 * std::numbers::pi;  // a microradian each
  description.gear_torque = description::GearTorque{.object = 0x60E401, .bits = 32, .counts_per_revolution = -counts};
  ServoDrive drive(description, DriveSettings{});
  CanFrame tpdo;
  tpdo.id = 0x183;
  tpdo.fd = tpdo.bit_rate_switch = true;
  tpdo.length = 12;  // of 11 bytes
  // The motor at 100 counts, 0.1 rad; the link at 0.0999 rad, -99900 counts.
  tpdo.data = {0x50, 0x02, 0x64, 0x00, 0x00, 0x00, 0x08, 0xC4, 0x79, 0xFE, 0xFF};
  drive.on_sync(ms);
  EXPECT_TRUE(drive.on_frame(tpdo, ms));
  EXPECT_NEAR(drive.gear_torque_Nm().value(), 10.0, 1e-6);
}

TEST_F(Cia402DriveTest, SaysWhereItStoodWhenItWasGivenUp) {
  const std::pair<const char*, const char*> rows[] = {
      {"183#400200000000",
       "it stayed in switch on disabled (statusword 0x0240): its power stage is kept off; is STO "
       "closed (E-stop released, safety relay on), is the power supply on (bit 4 says: no voltage)"},
      {"183#310200000000", "it stayed in ready to switch on (statusword 0x0231)"},
      {"183#330200000000", "it stayed in switched on (statusword 0x0233)"},
      {"183#370200000000", "it is enabled, but never says that it follows its targets (bit 12 of the statusword)"}};
  for (const auto& [tpdo, words] : rows) {
    drive = ServoDrive(thousand_counts_per_rad(), DriveSettings{});
    drive.start_cycle(now_ns);
    drive.request(DriveGoal::operation_enabled);
    cycle(tpdo);
    drive.request(DriveGoal::switched_off);
    cycle("183#500200000000");
    EXPECT_NE(drive.describe().find(words), std::string::npos) << drive.describe();
  }
}

TEST_F(Cia402DriveTest, KeepsTheFirstFaultAndTheLastEmergencyInWords) {
  enable();
  EXPECT_TRUE(drive.on_frame(frame_of("083#1186210000000000"), now_ns));
  cycle("183#3F2200000000");
  cycle("183#382200000000");
  EXPECT_TRUE(drive.on_frame(frame_of("083#0000000000000000"), now_ns));
  EXPECT_EQ(drive.fault(), DriveFault::emergency);
  EXPECT_FALSE(drive.following());
  EXPECT_EQ(drive.describe(),
            "drive of axis_3 (bus axes_1_3, node 3): fault (statusword 0x2238), following error; the drive sent an "
            "emergency message; last EMCY 8611: following error (error register 21: generic, profile)");
  drive.clear_fault();
  EXPECT_EQ(drive.fault(), DriveFault::none);
}

TEST_F(Cia402DriveTest, NoticesThatItLeftOperationByItself) {
  enable();
  cycle("183#170200000000");  // quick stop active
  EXPECT_EQ(drive.fault(), DriveFault::left_operation);
}

TEST_F(Cia402DriveTest, NoticesAShortTpdo) {
  enable();
  EXPECT_TRUE(drive.on_frame(frame_of("183#3712000000"), now_ns));
  EXPECT_EQ(drive.fault(), DriveFault::pdo_short);
}

TEST_F(Cia402DriveTest, NoticesALostHeartbeatAResetAndForeignNmtCommands) {
  {
    ServoDrive d(thousand_counts_per_rad(), DriveSettings{});
    d.start_cycle(0);
    d.on_sync(150 * ms);
    EXPECT_EQ(d.fault(), DriveFault::none);
    d.on_sync(150 * ms + 1);
    EXPECT_EQ(d.fault(), DriveFault::heartbeat_lost);
  }
  for (const auto& [frame, fault] :
       {std::pair{"703#00", DriveFault::restarted}, std::pair{"703#7F", DriveFault::not_operational},
        std::pair{"703#04", DriveFault::not_operational}, std::pair{"703#05", DriveFault::none}}) {
    ServoDrive d(thousand_counts_per_rad(), DriveSettings{});
    EXPECT_TRUE(d.on_frame(frame_of("703#00"), 0)) << "booting before the cycle is fine";
    d.start_cycle(0);
    EXPECT_TRUE(d.on_frame(frame_of(frame), 1));
    EXPECT_EQ(d.fault(), fault) << frame;
  }
}

TEST_F(Cia402DriveTest, CountsCyclesWithoutATpdo) {
  enable();
  EXPECT_TRUE(drive.fresh());
  cycle("");
  EXPECT_FALSE(drive.fresh());
  EXPECT_EQ(drive.cycles_without_tpdo(), 0U);
  cycle("");
  EXPECT_EQ(drive.cycles_without_tpdo(), 1U);
  cycle("");
  EXPECT_EQ(drive.cycles_without_tpdo(), 2U);
  cycle("183#371200000000");
  EXPECT_EQ(drive.cycles_without_tpdo(), 0U);
  EXPECT_TRUE(drive.on_frame(frame_of("183#371200000000"), now_ns));
  EXPECT_EQ(drive.repeated_tpdos(), 1U);
}

TEST_F(Cia402DriveTest, MissesNoTpdoBeforeTheFirstSync) {
  drive.start_cycle(0);
  cycle("");
  EXPECT_EQ(drive.cycles_without_tpdo(), 0U);
  cycle("");
  EXPECT_EQ(drive.cycles_without_tpdo(), 1U);
}

TEST_F(Cia402DriveTest, ATargetThatDoesNotFitIsAFaultAndTheOldOneStays) {
  enable();
  ASSERT_TRUE(drive.set_target_rad(0.5));
  for (const double target : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 2.2e6,
                              -2.2e6, -std::numeric_limits<double>::infinity()}) {
    drive.clear_fault();
    EXPECT_FALSE(drive.set_target_rad(target)) << target;
    EXPECT_EQ(drive.fault(), DriveFault::target_out_of_range);
    EXPECT_EQ(drive.target_counts(), 500);
  }
}

TEST_F(Cia402DriveTest, ReadsTheFlagsOfItsStatusword) {
  cycle("183#371A00000000");  // bits 12 and 11
  EXPECT_TRUE(drive.internal_limit());
  EXPECT_TRUE(drive.follows_command());
  EXPECT_FALSE(drive.following_error());
  cycle("183#B72200000000");  // bits 13 and 7
  EXPECT_TRUE(drive.following_error());
  EXPECT_TRUE(drive.warning());
}

TEST_F(Cia402DriveTest, PositionsAreSigned32Bits) {
  cycle("183#370600000080");
  EXPECT_EQ(drive.actual_counts(), std::numeric_limits<std::int32_t>::min());
  cycle("183#3706FFFFFF7F");
  EXPECT_EQ(drive.actual_counts(), std::numeric_limits<std::int32_t>::max());
  cycle("183#37069CFFFFFF");
  EXPECT_DOUBLE_EQ(drive.actual_rad(), -0.1);
}

TEST_F(Cia402DriveTest, TakesAnyBytes) {
  constexpr unsigned seed = 402;
  std::mt19937 random(seed);
  drive.start_cycle(0);
  drive.request(DriveGoal::operation_enabled);
  constexpr std::uint32_t ids[] = {0x183, 0x083, 0x703, 0x583, 0x203};
  for (int i = 0; i < 100'000; ++i) {
    CanFrame frame;
    frame.id = ids[random() % std::size(ids)];
    frame.length = static_cast<std::uint8_t>(random() % 9);
    for (std::size_t n = 0; n < frame.length; ++n) frame.data[n] = static_cast<std::uint8_t>(random());
    drive.on_sync(i * ms);
    drive.on_frame(frame, i * ms);
    drive.set_target_rad(std::ldexp(static_cast<double>(random()) - 2e9, static_cast<int>(random() % 200) - 100));
    CanFrame rpdo;
    if (drive.encode_rpdo(rpdo)) {
      ASSERT_EQ(rpdo.length, 6);
    }
    ASSERT_TRUE(std::isfinite(drive.actual_rad()));
    if (i % 1000 == 0) {
      ASSERT_FALSE(drive.describe().empty());
    }
    if (i % 7 == 0) drive.clear_fault();
  }
}

// ---- units ----

TEST(CountScale, TurnsRadiansIntoCountsAndBack) {
  DriveDescription description = thousand_counts_per_rad();
  description.offset_counts = 250;
  description.direction = -1;
  const CountScale scale(description);
  EXPECT_EQ(scale.counts(0.0), 250);
  EXPECT_EQ(scale.counts(1.0), -750);
  EXPECT_DOUBLE_EQ(scale.angle_rad(-750), 1.0);
  EXPECT_EQ(scale.counts(0.0004), 250);
  EXPECT_EQ(scale.counts(0.0006), 249);
}

TEST(CountScale, RoundTripsEveryCount) {
  DriveDescription description = thousand_counts_per_rad();
  description.counts_per_motor_revolution = 1048576.0;
  description.gear_ratio = 150.0;
  description.offset_counts = -1'200'003;
  const CountScale scale(description);
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int32_t> any(std::numeric_limits<std::int32_t>::min(),
                                                  std::numeric_limits<std::int32_t>::max());
  for (int i = 0; i < 200'000; ++i) {
    const std::int32_t counts = any(random);
    ASSERT_EQ(scale.counts(scale.angle_rad(counts)), counts);
  }
}

TEST(CountScale, NeverWraps) {
  const CountScale scale(thousand_counts_per_rad());
  EXPECT_EQ(scale.counts(2147483.647), std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(scale.counts(2147483.648), std::nullopt);
  EXPECT_EQ(scale.counts(-2147483.648), std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(scale.counts(-2147483.649), std::nullopt);
}

TEST(CountScale, RefusesWhatIsNoScale) {
  const auto refused = [](auto change) {
    DriveDescription description = thousand_counts_per_rad();
    change(description);
    EXPECT_THROW(CountScale{description}, SetupError);
  };
  refused([](DriveDescription& d) { d.counts_per_motor_revolution = 0.0; });
  refused([](DriveDescription& d) { d.counts_per_motor_revolution = std::numeric_limits<double>::quiet_NaN(); });
  refused([](DriveDescription& d) { d.gear_ratio = -1.0; });
  refused([](DriveDescription& d) { d.direction = 0; });
  refused([](DriveDescription& d) { d.range_rad = {-3.0, 3e6}; });
  refused([](DriveDescription& d) { d.offset_counts = std::numeric_limits<std::int32_t>::max(); });
}

TEST(InterpolationPeriod, IsExactOrRefused) {
  using P = InterpolationPeriod;
  EXPECT_EQ(interpolation_period(1'000'000), (P{1, -3}));
  EXPECT_EQ(interpolation_period(2'000'000), (P{2, -3}));
  EXPECT_EQ(interpolation_period(500'000), (P{5, -4}));
  EXPECT_EQ(interpolation_period(250'000), (P{25, -5}));
  EXPECT_EQ(interpolation_period(1'250'000), (P{125, -5}));
  EXPECT_EQ(interpolation_period(10'000'000), (P{1, -2}));
  EXPECT_EQ(interpolation_period(255'000), (P{255, -6}));
  EXPECT_EQ(interpolation_period(256'000), std::nullopt);
  EXPECT_EQ(interpolation_period(1'001'000), std::nullopt);
  EXPECT_EQ(interpolation_period(333'333), std::nullopt);
  EXPECT_EQ(interpolation_period(0), std::nullopt);
}

TEST(DriveSettings, RefuseAPeriodThatTheDrivesCannotHold) {
  DriveSettings settings;
  settings.period_ns = 333'333;
  try {
    settings.validate();
    FAIL() << "was taken";
  } catch (const SetupError& error) {
    EXPECT_EQ(error.key(), "timestep");
    EXPECT_NE(std::string(error.what()).find("0.333333 ms"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("60C2h"), std::string::npos) << error.what();
  }
  settings.period_ns = 100;  // 60C2h could, 1006h can't
  EXPECT_THROW(settings.validate(), SetupError);
}

TEST(ServoDrive, RefusesDescriptionsThatItCannotServe) {
  const auto refused = [](auto change, const std::string& part) {
    DriveDescription description = thousand_counts_per_rad();
    change(description);
    try {
      ServoDrive drive(description, DriveSettings{});
      ADD_FAILURE() << "was taken: " << part;
    } catch (const SetupError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  refused([](DriveDescription& d) { d.node = 0; }, "node: found 0");
  refused([](DriveDescription& d) { d.node = 127; }, "the controller's own");
  refused([](DriveDescription& d) { d.mode = "pv"; }, "expected csp, ip or cst");
  refused([](DriveDescription& d) { d.mode = "cst"; }, "rated_torque_Nm");
  refused([](DriveDescription& d) { d.profile = "modbus"; }, "expected cia402");
}

}  // namespace
}  // namespace proxarm::fieldbus
