// Drives brought up over SDO and NMT: what is set in them, and what the user is told when one isn't as expected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "fieldbus/cia402/cia402_goodbye.hpp"
#include "models/base/setup_error.hpp"
#include "tests/fieldbus/canopen/table_node.hpp"

namespace proxarm::fieldbus {
namespace {

using description::DriveDescription;
using description::SetupError;

constexpr std::int64_t ms = 1'000'000;

DriveDescription describe_drive(const std::string& joint, const std::string& bus, std::uint8_t node) {
  DriveDescription drive;
  drive.joint = joint;
  drive.bus = bus;
  drive.node = node;
  drive.counts_per_motor_revolution = 2000.0 * std::numbers::pi;  // 1000 counts per radian
  drive.gear_ratio = 1.0;
  drive.range_rad = {-3.0, 3.0};
  drive.max_acceleration_rad_per_s2 = 20.0;
  return drive;
}

// Two drives on one bus, one on another.
struct Cia402BringUpTest : ::testing::Test {
  ScriptedNetwork network{{"axes_1_2", "axes_3"}};
  TableNode one{network.bus(0), 1}, two{network.bus(0), 2}, three{network.bus(1), 3};
  DriveSettings settings;
  std::vector<ServoDrive> drives;
  std::vector<DriveSlot> slots;
  description::BringUp of_third;

  Cia402BringUpTest() {
    network.bus(0).on_send = [this](const CanFrame& frame) {
      one.on_frame(frame);
      two.on_frame(frame);
    };
    network.bus(1).on_send = [this](const CanFrame& frame) { three.on_frame(frame); };
  }
  std::vector<DriveIdentity> bring_up(const FrameHandler& other = {}, const Tell& tell = {}) {
    description::DriveDescription third = describe_drive("axis_3", "axes_3", 3);
    third.bring_up = of_third;
    drives = {ServoDrive(describe_drive("axis_1", "axes_1_2", 1), settings),
              ServoDrive(describe_drive("axis_2", "axes_1_2", 2), settings), ServoDrive(third, settings)};
    slots = {{&drives[0], 0}, {&drives[1], 0}, {&drives[2], 1}};
    return bring_up_drives(network, slots, other, tell);
  }
  // Axis 3 keeps an error of the session before, and NMT start waits for `frees`. What was told of it.
  std::vector<std::string> told_of_a_held_drive(const std::function<bool(const CanFrame&)>& frees) {
    three.starts = false;
    three.freed_by = frees;
    three.objects[{0x1001, 0}].value = 0x11;
    three.objects[{0x1003, 1}].value = 0x8130;
    std::vector<std::string> told;
    (void)bring_up({}, [&told](const std::string& line) { told.push_back(line); });
    for (const DriveSlot& slot : slots) EXPECT_EQ(slot.drive->nmt_state(), NmtState::operational);
    return told;
  }
  void forget_sent() {
    for (const auto& bus : network.buses) bus->sent.clear();
  }
  // The message of a failed bring-up; no drive may have been started.
  std::string refusal() {
    try {
      bring_up();
    } catch (const SetupError& error) {
      for (const auto& bus : network.buses) {
        for (const std::string& frame : bus->sent) EXPECT_NE(frame.substr(0, 6), "000#01") << "a drive was started";
        for (const std::string& frame : bus->sent) EXPECT_NE(frame[0], '2') << "a drive was commanded";
      }
      return error.what();
    }
    return "brought up";
  }
  static void has(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text << "\n  lacks: " << part;
  }
};

TEST_F(Cia402BringUpTest, SetsWhatADriveDoesWithUsAndWithoutUs) {
  const auto identities = bring_up();
  auto& od = three.objects;
  const auto value = [&od](int index, int sub) { return od.at({index, sub}).value; };
  EXPECT_EQ(value(0x1400, 1), 0x203U);
  EXPECT_EQ(value(0x1400, 2), 1U);
  EXPECT_EQ(value(0x1400, 5), 5U) << "RPDO timeout, five periods of 1 ms";
  EXPECT_EQ(value(0x1600, 0), 2U);
  EXPECT_EQ(value(0x1600, 1), 0x60400010U);
  EXPECT_EQ(value(0x1600, 2), 0x607A0020U);
  EXPECT_EQ(value(0x1800, 1), 0x40000183U);
  EXPECT_EQ(value(0x1800, 2), 1U);
  EXPECT_EQ(value(0x1A00, 0), 2U);
  EXPECT_EQ(value(0x1A00, 1), 0x60410010U);
  EXPECT_EQ(value(0x1A00, 2), 0x60640020U);
  for (int n = 1; n < 4; ++n) {
    EXPECT_NE(value(0x1400 + n, 1) >> 31, 0U) << "unused RPDO " << n + 1;
    EXPECT_NE(value(0x1800 + n, 1) >> 31, 0U) << "unused TPDO " << n + 1;
  }
  EXPECT_EQ(value(0x60C2, 1), 1U);
  EXPECT_EQ(value(0x60C2, 2), 0xFDU) << "10^-3 s";
  EXPECT_EQ(value(0x1006, 0), 1000U);
  EXPECT_EQ(value(0x1016, 1), 0x007F003CU) << "node 127 within 60 ms";
  EXPECT_EQ(value(0x1017, 0), 50U);
  EXPECT_EQ(value(0x1029, 1), 0U);
  EXPECT_EQ(value(0x6007, 0), 3U) << "quick stop";
  EXPECT_EQ(value(0x605A, 0), 2U);
  EXPECT_EQ(value(0x605B, 0), 1U);
  EXPECT_EQ(value(0x605C, 0), 1U);
  EXPECT_EQ(value(0x605D, 0), 1U);
  EXPECT_EQ(value(0x605E, 0), 2U);
  EXPECT_EQ(value(0x6060, 0), 8U);
  EXPECT_EQ(value(0x6061, 0), 8U);
  EXPECT_EQ(value(0x6065, 0), 50U) << "0.05 rad";
  EXPECT_EQ(value(0x6066, 0), 10U);
  EXPECT_EQ(value(0x6084, 0), 20000U);
  EXPECT_EQ(value(0x6085, 0), 20000U);
  EXPECT_EQ(three.state, 0x05);
  EXPECT_EQ(drives[2].nmt_state(), NmtState::operational);
  ASSERT_EQ(identities.size(), 3U);
  EXPECT_EQ(describe(identities[2]),
            "device type 0x00020192, vendor 0x000002E1, product 0x00001234, revision 0x00010002, serial number 77, "
            "supported modes 0x000003EF");
}

TEST_F(Cia402BringUpTest, ConfiguresDrivesSideBySide) {
  const std::int64_t begin_ns = network.time_ns;
  bring_up();
  const std::int64_t three_ns = network.time_ns - begin_ns;
  // Each exchange takes 0.15 ms here; one drive alone makes fewer than 130 of them.
  EXPECT_LT(three_ns, 30 * ms) << "three drives one after the other would take three times as long";
}

TEST_F(Cia402BringUpTest, StartsDrivesOnlyWhenAllAreConfigured) {
  bring_up();
  const auto& sent = network.bus(0).sent;
  const auto start = std::find(sent.begin(), sent.end(), "000#0101");
  ASSERT_NE(start, sent.end());
  EXPECT_EQ(sent.front(), "000#8001");
  EXPECT_TRUE(std::none_of(start, sent.end(), [](const std::string& frame) { return frame[0] == '6'; }));
}

TEST_F(Cia402BringUpTest, PassesFramesOfOthersOn) {
  network.bus(1).arrive("680#0000000000000000");
  std::vector<std::string> others;
  bring_up([&others](std::size_t bus, const TimedFrame& received) {
    others.push_back(std::to_string(bus) + " " + text_of(received.frame));
  });
  EXPECT_EQ(others, std::vector<std::string>{"1 680#0000000000000000"});
}

TEST_F(Cia402BringUpTest, WaitsForADriveThatIsStillBooting) {
  two.ignored = 5;  // a second, at 200 ms each
  EXPECT_NO_THROW(bring_up());
}

TEST_F(Cia402BringUpTest, ToleratesALostFrameOnTheWay) {
  int exchange = 0;
  network.bus(1).on_send = [&](const CanFrame& frame) {
    if (frame.id == 0x603 && ++exchange % 20 == 0) return;  // every 20th request is lost
    three.on_frame(frame);
  };
  EXPECT_NO_THROW(bring_up());
}

TEST_F(Cia402BringUpTest, NotesOptionalObjectsThatADriveHasnt) {
  three.objects.erase({0x1006, 0});
  three.objects.erase({0x605D, 0});
  three.objects.erase({0x6065, 0});
  three.objects.erase({0x6066, 0});
  const auto identities = bring_up();
  EXPECT_EQ(
      identities[2].missing,
      (std::vector<std::string>{"1006h:00 communication cycle period", "605Dh:00 halt option code (slow down on ramp)",
                                "6065h:00 following error window", "6066h:00 following error time out"}));
}

TEST_F(Cia402BringUpTest, NamesADriveThatDoesNotAnswer) {
  two.powered = false;
  const std::string text = refusal();
  has(text, "bus axes_1_2, node 2, object 1000h:00 device type: drive of axis_2: found no answer");
  has(text, "is it powered");
}

TEST_F(Cia402BringUpTest, NamesAllDrivesThatDoNotAnswer) {
  one.powered = two.powered = three.powered = false;
  has(refusal(), "also at fault: bus axes_1_2 node 2, bus axes_3 node 3");
}

TEST_F(Cia402BringUpTest, RefusesAnotherDeviceType) {
  three.objects[{0x1000, 0}].value = 0x00030191;
  has(refusal(),
      "bus axes_3, node 3, object 1000h:00 device type: drive of axis_3: found 0x00030191 (197009), expected "
      "0x00020192 (131474)");
}

TEST_F(Cia402BringUpTest, RefusesADriveWithoutCyclicSynchronousPosition) {
  three.objects[{0x6502, 0}].value = 0x036F;
  has(refusal(), "can't do cyclic synchronous position (mode 8)");
}

TEST_F(Cia402BringUpTest, RefusesADriveThatKeepsAnotherValue) {
  three.deaf = {{0x60C2, 1}};
  has(refusal(),
      "object 60C2h:01 interpolation time period value: drive of axis_3: found 0x02 (2), expected 0x01 (1); the "
      "drive took the value without an error but kept another");
}

TEST_F(Cia402BringUpTest, RefusesADriveThatWouldNotStopWithoutUs) {
  three.objects.erase({0x1016, 1});
  has(refusal(),
      "object 1016h:01 consumer heartbeat time (of the controller): drive of axis_3: found SDO abort 06020000: "
      "object does not exist in the object dictionary");
}

TEST_F(Cia402BringUpTest, SaysWhyADriveAborts) {
  three.aborts[{0x6065, 0}] = 0x06090031;
  has(refusal(),
      "object 6065h:00 following error window: drive of axis_3: found SDO abort 06090031: value of parameter "
      "written too high (download only), expected to write 0x00000032 (50)");
}

// CiA 301, table 22, row by row; the spelling of "download only" and so on is the table's.
TEST_F(Cia402BringUpTest, SaysEachAbortInTheStandardsWords) {
  const std::pair<std::uint32_t, const char*> rows[] = {
      {0x05040001, "client/server command specifier not valid or unknown"},
      {0x05040005, "out of memory"},
      {0x06010000, "unsupported access to an object"},
      {0x06010001, "attempt to read a write only object"},
      {0x06010002, "attempt to write a read only object"},
      {0x06020000, "object does not exist in the object dictionary"},
      {0x06040041, "object cannot be mapped to the PDO"},
      {0x06040042, "the number and length of the objects to be mapped would exceed PDO length"},
      {0x06040043, "general parameter incompatibility reason"},
      {0x06040047, "general internal incompatibility in the device"},
      {0x06060000, "access failed due to a hardware error"},
      {0x06070010, "data type does not match, length of service parameter does not match"},
      {0x06070012, "data type does not match, length of service parameter too high"},
      {0x06070013, "data type does not match, length of service parameter too low"},
      {0x06090011, "sub-index does not exist"},
      {0x06090030, "invalid value for parameter (download only)"},
      {0x06090031, "value of parameter written too high (download only)"},
      {0x06090032, "value of parameter written too low (download only)"},
      {0x06090036, "maximum value is less than minimum value"},
      {0x060A0023, "resource not available: SDO connection"},
      {0x08000000, "general error"},
      {0x08000020, "data cannot be transferred or stored to the application"},
      {0x08000021, "data cannot be transferred or stored to the application because of local control"},
      {0x08000022, "data cannot be transferred or stored to the application because of the present device state"},
      {0x08000023, "object dictionary dynamic generation fails or no object dictionary is present"},
      {0x08000024, "no data available"},
      {0x0BADC0DE, "unknown abort code"}};
  for (const auto& [code, wording] : rows) {
    three.aborts[{0x1016, 1}] = code;
    char head[32];
    std::snprintf(head, sizeof head, "SDO abort %08X: ", code);
    has(refusal(),
        "bus axes_3, node 3, object 1016h:01 consumer heartbeat time (of the controller): drive of axis_3: "
        "found " +
            std::string(head) + wording);
    EXPECT_EQ(three.state, 0x7F) << "nothing is enabled";
  }
}

TEST_F(Cia402BringUpTest, AbortsOfOptionalObjectsThatExistAreRefusalsToo) {
  three.aborts[{0x605A, 0}] = 0x06090030;
  has(refusal(), "SDO abort 06090030: invalid value for parameter");
}

// Drives have fewer option codes and narrower ranges than the profile: it is theirs then, and what is lost is said.
TEST_F(Cia402BringUpTest, AnOptionalObjectThatRefusesTheValueIsTakenAsItIsAndTold) {
  const TableNode::Key keys[] = {{0x605A, 0}, {0x605B, 0}, {0x605E, 0}, {0x6065, 0},
                                 {0x6085, 0}, {0x1006, 0}, {0x1029, 1}, {0x1400, 5}};
  for (const std::uint32_t code : {0x06090030U, 0x06090031U, 0x06090032U}) {
    for (const TableNode::Key& key : keys) {
      three.write_aborts = {{key, code}};
      three.objects = TableNode::servo_drive();
      EXPECT_NO_THROW(bring_up()) << std::hex << key.first;
      char name[16];
      std::snprintf(name, sizeof name, "%04Xh:%02X is 0x", key.first, key.second);
      ASSERT_EQ(drives[2].losses().size(), 2U) << name;
      has(drives[2].losses().front(), name);
      has(drives[2].losses().front(), " and can't be set to ");
    }
  }
}

TEST_F(Cia402BringUpTest, A6007hThatRefusesTheValueIsTakenUnlessItDoesNothing) {
  three.write_aborts = {{{0x6007, 0}, 0x06090030}};
  EXPECT_NO_THROW(bring_up());
  has(drives[2].losses().front(), "how it stops without the controller is its own affair");
  forget_sent();
  three.objects[{0x6007, 0}].value = 0;
  has(refusal(),
      "object 6007h:00 abort connection option code (quick stop): drive of axis_3: found 0x0000 (0), which "
      "can't be written");
}

TEST_F(Cia402BringUpTest, AnObjectThatIsNeededMustTakeItsValue) {
  three.write_aborts = {{{0x1016, 1}, 0x06090030}};
  has(refusal(), "SDO abort 06090030: invalid value for parameter");
  for (const TableNode::Key& key : {TableNode::Key{0x6060, 0}, {0x60C2, 1}}) {
    three.write_aborts = {{key, 0x06090030}};
    three.objects = TableNode::servo_drive();
    three.objects[key].value = 3;
    has(refusal(), "found 0x03 (3), which can't be written (SDO abort 06090030: invalid value for parameter");
  }
}

// What a cell says of a drive in `bring_up`.
class WithBringUp : public Cia402BringUpTest {
 protected:
  // The first write of an object, among all writes to the third drive; −1: never.
  [[nodiscard]] std::ptrdiff_t place_of(TableNode::Key key) const {
    const auto found = std::find(three.written.begin(), three.written.end(), key);
    return found == three.written.end() ? -1 : found - three.written.begin();
  }
};

TEST_F(WithBringUp, SkippedObjectsAreNotTouchedAndTold) {
  of_third.skip = {0x102901, 0x605A00};
  EXPECT_NO_THROW(bring_up());
  EXPECT_EQ(place_of({0x1029, 1}), -1);
  EXPECT_EQ(place_of({0x605A, 0}), -1);
  EXPECT_GE(place_of({0x605B, 0}), 0);
  has(drives[2].losses().front(), "1029h:01 isn't touched (bring_up: skip)");
  of_third.skip = {0x101601};
  EXPECT_THROW(bring_up(), SetupError) << "a must";
  of_third.skip = {0x230000};
  EXPECT_THROW(bring_up(), SetupError) << "never touched";
}

TEST_F(WithBringUp, WhatIsWrittenFirstComesBeforeTheMapping) {
  three.objects[{0x2300, 0}] = {2, 0};
  of_third.write = {{0x606000, 8, 8}, {0x230000, 16, 0xFFFE}};
  EXPECT_NO_THROW(bring_up());
  EXPECT_GE(place_of({0x6060, 0}), 0);
  EXPECT_LT(place_of({0x6060, 0}), place_of({0x2300, 0}));
  EXPECT_LT(place_of({0x2300, 0}), place_of({0x1600, 1}));
  EXPECT_EQ((three.objects[{0x2300, 0}].value), 0xFFFEU);
}

TEST_F(WithBringUp, ADriveThatIsStoppedByItsSetpointTimerMustHaveIt) {
  of_third.stops_by = description::StopsBy::setpoint_timer;
  EXPECT_NO_THROW(bring_up());
  EXPECT_EQ(place_of({0x1016, 1}), -1);
  EXPECT_GE(place_of({0x1400, 5}), 0);
  three.aborts[{0x1400, 5}] = 0x06090011;
  forget_sent();
  has(refusal(), "object 1400h:05 RPDO event timer (timeout)");
}

// CiA 301, 7.2.8.3.2.1: life time = guard time (100Ch, ms) × factor (100Dh).
TEST_F(WithBringUp, ADriveThatGuardsItsLifeIsToldForHowLong) {
  three.objects.erase({0x1016, 1});
  three.objects[{0x100C, 0}] = {2, 7};
  three.objects[{0x100D, 0}] = {1, 0};
  of_third.stops_by = description::StopsBy::life_guarding;
  EXPECT_NO_THROW(bring_up());
  EXPECT_EQ((three.objects[{0x100C, 0}].value), 20U);
  EXPECT_EQ((three.objects[{0x100D, 0}].value), 3U);
  CanFrame request;
  ASSERT_TRUE(drives[2].guard_request(request));
  EXPECT_EQ(request.id, 0x703U);
  EXPECT_TRUE(request.remote);
  EXPECT_FALSE(drives[0].guard_request(request));
  three.objects.erase({0x100C, 0});
  forget_sent();
  has(refusal(), "object 100Ch:00 guard time (of the controller)");
}

// CiA 301: types 0 to 240 act at SYNC, 254 and 255 when the PDO comes.
TEST_F(Cia402BringUpTest, AnRpdoThatIsEventDrivenForGoodIsTakenAndTold) {
  for (const std::uint32_t type : {254U, 255U}) {
    three.objects[{0x1400, 2}].value = type;
    three.write_aborts = {{{0x1400, 2}, 0x06010002}};
    EXPECT_NO_THROW(bring_up());
    has(drives[2].losses().front(), "1400h:02 is " + std::string(type == 254 ? "0xFE (254)" : "0xFF (255)"));
    has(drives[2].losses().front(), "acts as soon as it comes");
  }
  three.write_aborts = {{{0x1800, 2}, 0x06010002}};
  three.objects[{0x1800, 2}].value = 255;
  forget_sent();
  has(refusal(), "object 1800h:02 TPDO transmission type: drive of axis_3: found 0xFF (255), which can't be written");
}

TEST_F(Cia402BringUpTest, A60C2hThatCantBeWrittenIsTakenWhereItFits) {
  three.write_aborts = {{{0x60C2, 2}, 0x06010002}};
  EXPECT_NO_THROW(bring_up());
  forget_sent();
  three.objects[{0x60C2, 2}].value = 0xFC;
  has(refusal(), "object 60C2h:02 interpolation time index: drive of axis_3: found 0xFC (252), which can't be written");
}

TEST_F(Cia402BringUpTest, WaitsAWhileForTheModeToChangeThenSaysSo) {
  three.mode_follows = false;
  const std::int64_t begin_ns = network.time_ns;
  has(refusal(), "object 6061h:00 modes of operation display: drive of axis_3: found 0x00 (0), expected 0x08 (8)");
  EXPECT_GE(network.time_ns - begin_ns, 500 * ms);
}

TEST_F(Cia402BringUpTest, RefusesADriveThatRestartsWhileItIsConfigured) {
  int exchange = 0;
  network.bus(1).on_send = [&](const CanFrame& frame) {
    if (++exchange == 50) network.bus(1).arrive("703#00");
    three.on_frame(frame);
  };
  has(refusal(), "bus axes_3, node 3: drive of axis_3: found a restart while it was configured");
}

TEST_F(Cia402BringUpTest, ABootUpMessageBeforeTheFirstAnswerIsFine) {
  network.bus(1).arrive("703#00", 10'000);
  EXPECT_NO_THROW(bring_up());
}

TEST_F(Cia402BringUpTest, RepeatsWhatTheDriveSaidByItself) {
  network.bus(1).arrive("083#1032040000000000");
  three.aborts[{0x6060, 0}] = 0x08000022;
  has(refusal(),
      "because of the present device state, expected to write 0x08 (8); the drive also sent EMCY 3210: DC link over "
      "voltage (error register 04: voltage)");
}

TEST_F(Cia402BringUpTest, SaysWhenADriveDoesNotStart) {
  three.starts = false;
  try {
    bring_up();
    FAIL() << "brought up";
  } catch (const SetupError& error) {
    has(error.what(),
        "bus axes_3, node 3: drive of axis_3, NMT state in its heartbeat: found pre-operational, expected "
        "operational");
  }
}

// The words of one that is held back: what it holds, and each means that was tried.
const std::string of_three = "drive of axis_3 (bus axes_3, node 3)";
const std::string holds = of_three +
                          " holds EMCY 8130: life guard error or heartbeat error (error register 11: generic, "
                          "communication) from before this session, and refuses NMT start";

TEST_F(Cia402BringUpTest, ADriveThatHoldsAnErrorIsHelpedByAFaultResetFirst) {
  const auto told = told_of_a_held_drive([](const CanFrame& f) {
    return f.id == 0x603 && f.data[0] == 0x2B && f.data[1] == 0x40 && f.data[2] == 0x60 && f.data[4] == 0x80;
  });
  EXPECT_EQ(told, (std::vector<std::string>{holds, of_three + ": started after a fault reset"}));
  EXPECT_EQ(three.objects.at({0x6040, 0}).value, 0U);
  EXPECT_EQ(three.objects.at({0x1006, 0}).value, 1000U);
  for (const std::string& frame : network.bus(1).sent) EXPECT_NE(frame, "080#");
}

TEST_F(Cia402BringUpTest, ThenBySyncAndHeartbeatBeforeNmtStart) {
  int syncs = 0, beats = 0;
  const auto told = told_of_a_held_drive([&](const CanFrame& f) {
    syncs += f.id == 0x080 ? 1 : 0;
    beats += f.id == 0x77F && f.data[0] == 0x05 ? 1 : 0;
    return syncs >= 50 && beats >= 3;
  });
  EXPECT_EQ(told, (std::vector<std::string>{holds, of_three + ": not started after a fault reset",
                                            of_three + ": started after SYNC and heartbeat before NMT start"}));
  EXPECT_EQ(three.resets, 0);
  EXPECT_EQ(three.objects.at({0x1006, 0}).value, 0U) << "no SYNC comes until the first cycle";
  EXPECT_EQ(three.objects.at({0x1016, 1}).value, 0x007F003CU);
  has(drives[2].losses().front(), "1006h:00 stays 0");
}

TEST_F(Cia402BringUpTest, AndByAResetOfItsOwnCommunicationLast) {
  const auto told = told_of_a_held_drive([](const CanFrame& f) { return f.id == 0 && f.data[0] == 0x82; });
  ASSERT_EQ(told.size(), 4U);
  EXPECT_EQ(told.back(), of_three + ": started after NMT reset communication (82h)");
  EXPECT_EQ(three.resets, 1);
  EXPECT_EQ(three.objects.at({0x1006, 0}).value, 1000U) << "configured anew";
  EXPECT_EQ(three.objects.at({0x1400, 1}).value, 0x203U);
  EXPECT_EQ(one.resets + two.resets, 0) << "for that node alone";
  for (const std::string& frame : network.bus(0).sent) EXPECT_NE(frame.substr(0, 6), "000#82");
}

TEST_F(Cia402BringUpTest, ADriveThatNothingHelpsIsNamedWithWhatItHoldsAndWhatWasTried) {
  try {
    (void)told_of_a_held_drive([](const CanFrame&) { return false; });
    FAIL() << "brought up";
  } catch (const SetupError& error) {
    has(error.what(), "found pre-operational, holding EMCY 8130");
    has(error.what(), "after a fault reset, SYNC and heartbeat before NMT start, NMT reset communication (82h)");
  }
}

TEST_F(Cia402BringUpTest, SaysWhenTheInterfaceIsDown) {
  network.bus(1).refuse = [](const CanFrame&) { return SendResult::down; };
  has(refusal(),
      "bus axes_3, node 3: the NMT command enter pre-operational could not be sent: found an interface that is "
      "down");
}

TEST_F(Cia402BringUpTest, RefusesTwoDrivesWithOneNodeOnOneBus) {
  drives = {ServoDrive(describe_drive("axis_1", "axes_1_2", 1), settings),
            ServoDrive(describe_drive("axis_4", "axes_3", 1), settings)};
  slots = {{&drives[0], 0}, {&drives[1], 0}};
  try {
    bring_up_drives(network, slots);
    FAIL() << "brought up";
  } catch (const SetupError& error) {
    has(error.what(), "found axis_1 and axis_4, expected one node number each");
    EXPECT_TRUE(network.bus(0).sent.empty());
  }
}

TEST_F(Cia402BringUpTest, TakesDrivesOutOfOperationalAtTheEnd) {
  bring_up();
  network.bus(0).sent.clear();
  leave_operational(network, slots);
  EXPECT_EQ(network.bus(0).sent, (std::vector<std::string>{"000#8001", "000#8002"}));
  EXPECT_EQ(one.state, 0x7F);
}

// Whatever period is asked for, what ends up in 60C2h and 1006h is that period exactly.
TEST_F(Cia402BringUpTest, SetsTheExactPeriod) {
  for (const std::int64_t period_ns : {250'000, 500'000, 1'000'000, 1'250'000, 2'000'000, 4'000'000, 10'000'000}) {
    settings.period_ns = period_ns;
    bring_up();
    const double units = three.objects.at({0x60C2, 1}).value;
    const auto exponent = static_cast<std::int8_t>(three.objects.at({0x60C2, 2}).value);
    EXPECT_NEAR(units * std::pow(10.0, exponent) * 1e9, static_cast<double>(period_ns), 1e-6);
    EXPECT_EQ(three.objects.at({0x1006, 0}).value * 1000, period_ns);
    EXPECT_GE(three.objects.at({0x1400, 5}).value * ms, 5 * period_ns);
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
