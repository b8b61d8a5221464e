// Sensors that are known by their files alone. All frames here are written by hand from the makers' figures; none comes
// from an encoder of ours.
#include "fieldbus/sensors/described_sensor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <string>

#include "models/base/setup_error.hpp"
#include "models/files/yaml_file.hpp"
#include "tests/allocation_count.hpp"
#include "tests/fieldbus/can/scripted_network.hpp"
#include "tests/source_file.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t us = 1'000, ms = 1'000'000;
const std::filesystem::path source_dir = source_file();

description::SensorDescription shipped(const std::string& name) {
  return description::load_sensor(source_dir / "models/sensors" / (name + ".yaml"));
}

// With its identifiers set to three above the drives'.
const description::SensorChoices robotous_ids{
    .file = "cell.yaml", .settings = {{"command_id", 0x1F0}, {"first_id", 0x1F1}, {"second_id", 0x1F2}}};

description::SensorDescription set(const std::string& name, const description::SensorChoices& choices) {
  return description::load_sensor(source_dir / "models/sensors" / (name + ".yaml"), choices);
}

std::string refusal_of(const std::string& name, const description::SensorChoices& choices) {
  try {
    static_cast<void>(DescribedSensor(set(name, choices), {.bus_name = "sensor"}));
  } catch (const SetupError& error) {
    return error.what();
  }
  return "taken";
}

description::SensorDescription written(const std::string& text) {
  return description::read_sensor(description::YamlNode::parse(text, "own.yaml"));
}

struct Rig {
  explicit Rig(const description::SensorDescription& description, std::uint32_t base_id = 0)
      : sensor(description, {.bus_name = "sensor", .base_id = base_id}), extended(description.described->extended) {
    CanFrame none;
    sensor.poll(now_ns, none);
  }
  bool take(const std::string& text, std::int64_t after_ns = 100 * us) {
    CanFrame frame = frame_of(text);
    frame.extended = extended;
    now_ns += after_ns;
    return sensor.on_frame(frame, now_ns);
  }
  // What a sample of these frames reads; the next cycle's poll has been before it.
  Wrench read(const std::vector<std::string>& frames) {
    CanFrame none;
    sensor.poll(now_ns, none);
    for (const std::string& frame : frames) EXPECT_TRUE(take(frame)) << frame;
    EXPECT_TRUE(sensor.fresh()) << frames.front();
    return sensor.latest().wrench_S;
  }
  std::int64_t now_ns = 1'000 * ms;
  DescribedSensor sensor;
  bool extended;
};

void expect_wrench(const Wrench& got, const Wrench& expected) {
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(got[i], expected[i], 1e-9) << i;
}

// ---- AIDIN AFT200: 0x01 force, 0x02 torque, u16 big-endian and two unused bytes; F = n/100 − 300, T = n/500 − 50

// 7530 is 30000, no force; 61A8 is 25000, no torque.
TEST(DescribedSensor, ReadsAnAidinsBytes) {
  Rig rig(shipped("aidin_aft200"));
  expect_wrench(rig.read({"001#7530753075300000", "002#61A861A861A80000"}), {0, 0, 0, 0, 0, 0});
  // 7594 = 30100: 1 N; 6D60 = 28000: −20 N; 7531 = 30001: 0.01 N; 639C = 25500: 1 Nm; 61A7: −0.002; 6590 = 26000: 2
  expect_wrench(rig.read({"001#75946D6075310000", "002#639C61A765900000"}), {1, -20, 0.01, 1, -0.002, 2});
  EXPECT_FALSE(rig.sensor.latest().saturated);
  EXPECT_TRUE(rig.sensor.latest().healthy);
}

TEST(DescribedSensor, StartsAnAidinWithTheMakersCommands) {
  ScriptedNetwork network{{"sensor"}};
  Conversation c(network.bus(0), {"> 102#0102020000000000",  // clear bias
                                  "> 102#010503E800000000",  // period 1000 us
                                  "> 102#0103010000000000",  // stream
                                  "< 001#7530753075300000", "< 002#61A861A861A80000"});
  DescribedSensor sensor(shipped("aidin_aft200"), {.bus_name = "sensor"});
  sensor.start(network, 0);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(sensor.identity(), "AIDIN ROBOTICS AFT200-D80 (aidin_aft200.yaml), streams 1000 samples a second");
  EXPECT_EQ(sensor.wanted_ids(), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(sensor.used_ids(), (std::vector<std::uint32_t>{1, 2, 0x102}));
}

// ---- Robotous RFT: 16 bytes in two frames, first byte 0B, six i16 big-endian, Tx split; F/50, T/2000

TEST(DescribedSensor, ReadsARobotousValueThatIsSplitAcrossItsFrames) {
  Rig rig(set("robotous_rft", robotous_ids));
  // Fx 0032 = 50: 1 N; Fy FFCE = −50: −1 N; Fz 01F4 = 500: 10 N; Tx 07|D0 = 2000: 1 Nm; Ty F830 = −2000: −1 Nm;
  // Tz 0001: 0.0005 Nm; no overload
  expect_wrench(rig.read({"1F1#0B0032FFCE01F407", "1F2#D0F8300001000000"}), {1, -1, 10, 1, -1, 0.0005});
  EXPECT_FALSE(rig.sensor.latest().saturated);
  // Tx −1 = FF|FF; overload status 04
  expect_wrench(rig.read({"1F1#0B0000000000 00FF", "1F2#FF00000000040000"}), {0, 0, 0, -0.0005, 0, 0});
  EXPECT_TRUE(rig.sensor.latest().saturated);
}

TEST(DescribedSensor, TakesARobotousAnswerToAnotherCommandForNoSample) {
  Rig rig(set("robotous_rft", robotous_ids));
  rig.take("1F1#0F01000000000000");  // the rate has been set
  rig.take("1F2#0000000000000000");
  EXPECT_FALSE(rig.sensor.fresh());
}

TEST(DescribedSensor, StartsARobotousStream) {
  ScriptedNetwork network{{"sensor"}};
  Conversation c(network.bus(0), {"> 1F0#0C00000000000000", "> 1F0#1100000000000000", "> 1F0#0F08000000000000",
                                  "> 1F0#0B00000000000000", "< 1F1#0B00000000000000", "< 1F2#0000000000000000"});
  DescribedSensor sensor(set("robotous_rft", robotous_ids), {.bus_name = "sensor"});
  sensor.start(network, 0);
  EXPECT_TRUE(c.complete()) << c.mistakes;
}

// Commands at 64h, data at 1 and 2.
TEST(DescribedSensor, StartsARobotousAsItIsDelivered) {
  ScriptedNetwork network{{"sensor"}};
  Conversation c(network.bus(0), {"> 064#0C00000000000000", "> 064#1100000000000000", "> 064#0F08000000000000",
                                  "> 064#0B00000000000000", "< 001#0B00000000000000", "< 002#0000000000000000"});
  DescribedSensor sensor(shipped("robotous_rft"), {.bus_name = "sensor"});
  sensor.start(network, 0);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(sensor.used_ids(), (std::vector<std::uint32_t>{1, 2, 0x64}));
}

// 0032 = 50 is 1 N of an RFT60-HA01, half of that where 1 N is 100 counts; 07D0 = 2000 is 1 Nm, 0.4 of 5000 a Nm.
TEST(DescribedSensor, ReadsAnotherModelByItsDivisorsAndRanges) {
  description::SensorChoices choices = robotous_ids;
  choices.settings.push_back({"force_divisor", 100});
  choices.settings.push_back({"torque_divisor", 5000});
  choices.force_range_N = {4, 4, 4};
  Rig rig(set("robotous_rft", choices));
  expect_wrench(rig.read({"1F1#0B0032FFCE000007", "1F2#D000000000000000"}), {0.5, -0.5, 0, 0.4, 0, 0});
  EXPECT_FALSE(rig.sensor.latest().saturated);
  expect_wrench(rig.read({"1F1#0B0000000001F400", "1F2#0000000000000000"}), {0, 0, 5, 0, 0, 0});
  EXPECT_TRUE(rig.sensor.latest().saturated) << "5 N of 4";
}

// Commands begin with the sensor's number.
TEST(DescribedSensor, StartsTheThirdAidinOfABus) {
  ScriptedNetwork network{{"sensor"}};
  Conversation c(network.bus(0), {"> 102#0302020000000000", "> 102#030503E800000000", "> 102#0303010000000000",
                                  "< 005#7530753075300000", "< 006#61A861A861A80000"});
  DescribedSensor sensor(set("aidin_aft200", {.settings = {{"sensor_number", 3}, {"force_id", 5}, {"torque_id", 6}}}),
                         {.bus_name = "sensor"});
  sensor.start(network, 0);
  EXPECT_TRUE(c.complete()) << c.mistakes;
}

TEST(DescribedSensor, RefusesSettingsThatItsFileHasntOrThatFallTogether) {
  const auto refusal = [](const char* name, std::int64_t value) {
    return refusal_of("robotous_rft", {.file = "cell.yaml", .settings = {{name, value, 7}}});
  };
  EXPECT_THAT(refusal("base", 1), AllOf(HasSubstr("cell.yaml:7"), HasSubstr("found \"base\""),
                                        HasSubstr("one of those of robotous_rft.yaml: command_id, first_id")));
  EXPECT_THAT(refusal("first_id", 0), AllOf(HasSubstr("cell.yaml:7: sensor.settings.first_id: found 0"),
                                            HasSubstr("1 to 2047 (identifier of a sample's first frame)")));
  EXPECT_THAT(refusal("first_id", 0x800), HasSubstr("found 2048"));
  EXPECT_THAT(refusal("first_id", 2), HasSubstr("first_id and second_id with one value, 2"));
  EXPECT_THAT(refusal("command_id", 1), HasSubstr("command_id and first_id with one value, 1"));
  EXPECT_THAT(refusal("command_id", 0x80), HasSubstr("neither NMT's (0x000) nor SYNC's (0x080)"));
  EXPECT_THAT(refusal_of("onrobot_hex", {.file = "cell.yaml", .settings = {{"first_id", 1, 7}}}),
              HasSubstr("none: onrobot_hex.yaml has no settings"));
  EXPECT_THAT(refusal_of("ati_net_can_oem", {.file = "cell.yaml", .settings = {{"first_id", 1, 7}}}),
              HasSubstr("has no settings"));
}

TEST(DescribedSensor, ASettingFitsWhereItIsNamed) {
  const std::string text =
      "name: own\nprotocol: described\nforce_range_N: [1, 1, 1]\ntorque_range_Nm: [1, 1, 1]\n"
      "settings: {number: {default: 300, min: 0, max: 1000, means: its number}}\n"
      "frames: [{id: 0x10, bytes: 8}]\nrate_Hz: 1000\n"
      "signals:\n  fx: {byte: 0, bits: 8}\n  fy: {byte: 1, bits: 8}\n  fz: {byte: 2, bits: 8}\n"
      "  tx: {byte: 3, bits: 8}\n  ty: {byte: 4, bits: 8}\n  tz: {byte: 5, bits: 8}\n"
      "commands: {start: {id: 0x11, data: [number]}}\n";
  try {
    static_cast<void>(written(text));
    FAIL() << "300 in a byte";
  } catch (const SetupError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("number = 300"), HasSubstr("a setting of 0 to 255")));
  }
}

// ---- OnRobot HEX: AA 07 08 10, counter, status, six i16 big-endian, sum of all bytes before

// AA+07+08+10 = C9; counter 0001: 1; Fx 000A: 10; Fy FFF6: F5+100 = 1F5; Fz 0064: 64; Tx 03E8: EB; Ty FC18: 114;
// Tz 0001: 1. In all C9 + 1 + A + 1F5 + 64 + EB + 114 + 1 = 52D.
TEST(DescribedSensor, ReadsAHexPacketOfThreeFrames) {
  Rig rig(shipped("onrobot_hex"));
  expect_wrench(rig.read({"100#AA07081000010000", "100#000AFFF6006403E8", "100#FC180001052D"}),
                {1, -1, 10, 1, -1, 0.001});
  // A byte wrong: no sample.
  CanFrame none;
  rig.sensor.poll(rig.now_ns, none);
  rig.take("100#AA07081000020000");
  rig.take("100#000AFFF6006403E8");
  rig.take("100#FC180001052D");
  EXPECT_FALSE(rig.sensor.fresh());
  EXPECT_EQ(rig.sensor.counts().bad_checksums, 1U);
}

TEST(DescribedSensor, TellsAHexOverloadAndErrorApart) {
  Rig rig(shipped("onrobot_hex"));
  // Status 0200, Fx overload: CB + 1 = CC. C9 + counter 1 + 02 = CC
  rig.read({"100#AA07081000010200", "100#0000000000000000", "100#0000000000CC"});
  EXPECT_TRUE(rig.sensor.latest().saturated);
  EXPECT_TRUE(rig.sensor.latest().healthy);
  EXPECT_EQ(rig.sensor.describe_status(rig.sensor.latest().status), "status 0x0200: Fx overload");
  // Status 0400, a sensor error: C9 + 2 + 04 = CF
  rig.read({"100#AA07081000020400", "100#0000000000000000", "100#0000000000CF"});
  EXPECT_FALSE(rig.sensor.latest().saturated);
  EXPECT_FALSE(rig.sensor.latest().healthy);
}

TEST(DescribedSensor, CountsAHexsLostSamplesAndDropsRepeatedAndOlderOnes) {
  Rig rig(shipped("onrobot_hex"));
  const auto send = [&](const std::string& count, const std::string& sum) {
    CanFrame none;
    rig.sensor.poll(rig.now_ns, none);
    rig.take("100#AA070810" + count + "0000");
    rig.take("100#0000000000000000");
    rig.take("100#00000000" + sum);
    return rig.sensor.fresh();
  };
  EXPECT_TRUE(send("0001", "00CA"));
  EXPECT_TRUE(send("0005", "00CE"));
  EXPECT_EQ(rig.sensor.counts().lost, 3U);
  EXPECT_FALSE(send("0005", "00CE"));
  EXPECT_FALSE(send("0004", "00CD"));
  EXPECT_EQ(rig.sensor.counts().repeated, 2U);
  EXPECT_TRUE(send("0006", "00CF"));  // and goes on
}

// AA + 32 + 03 = DF. Stop: filter 1 (500 Hz): E0. Rate code 1 (1000 Hz): E1. Nine bytes go as eight and one.
TEST(DescribedSensor, ConfiguresAHexInTwoFrames) {
  ScriptedNetwork network{{"sensor"}};
  Conversation c(network.bus(0), {"> 101#AA00320300010000", "> 101#E0", "> 101#AA00320301010000", "> 101#E1",
                                  "< 100#AA07081000010000", "< 100#0000000000000000", "< 100#0000000000CA"});
  DescribedSensor sensor(shipped("onrobot_hex"), {.bus_name = "sensor"});
  sensor.start(network, 0);
  EXPECT_TRUE(c.complete()) << c.mistakes;
}

// ---- WACOH DynPick: 29 bits, command << 24 | option << 8 | id; u16 big-endian, zero at 8192 = 2000h

TEST(DescribedSensor, ReadsAWacohs29BitFrames) {
  Rig rig(shipped("wacoh_dynpick"), 0x07);
  expect_wrench(rig.read({"01000007#200020002000", "02000007#200020002000"}), {0, 0, 0, 0, 0, 0});
  // 3FF0 = 16368, 8176 above zero: 8176/32.765 N = 249.5; beyond the 200 N that it is made for
  const Wrench w = rig.read({"01000007#20211FDF2000", "02000007#21B51E4B2000"});
  EXPECT_NEAR(w[0], 33 / 32.765, 1e-9);    // 2021h − 2000h = 33
  EXPECT_NEAR(w[1], -33 / 32.765, 1e-9);   // 1FDFh
  EXPECT_NEAR(w[3], 437 / 436.867, 1e-9);  // 21B5h
  EXPECT_NEAR(w[4], -437 / 436.867, 1e-9);
  EXPECT_FALSE(rig.sensor.latest().saturated);
  rig.read({"01000007#3FF020002000", "02000007#200020002000"});
  EXPECT_TRUE(rig.sensor.latest().saturated);
  EXPECT_EQ(rig.sensor.wanted_ids(), (std::vector<std::uint32_t>{0x81000007, 0x82000007}));
  EXPECT_FALSE(rig.take("01000008#200020002000")) << "another sensor's";
}

TEST(DescribedSensor, StartsAWacohStream) {
  ScriptedNetwork network{{"sensor"}};
  DescribedSensor sensor(shipped("wacoh_dynpick"), {.bus_name = "sensor", .base_id = 0x07});
  network.bus(0).on_send = [&](const CanFrame& frame) {
    EXPECT_TRUE(frame.extended);
    if (frame.id != 0x03000007) return;
    for (const char* text : {"01000007#200020002000", "02000007#200020002000"}) {
      CanFrame answer = frame_of(text);
      answer.extended = true;
      network.bus(0).arrive(answer);
    }
  };
  sensor.start(network, 0);
  EXPECT_EQ(network.bus(0).sent, (std::vector<std::string>{"4000007#", "3000007#"}));
}

// ---- What goes wrong on the wire

struct AidinFaults : ::testing::Test {
  Rig rig{shipped("aidin_aft200")};
  // Force of 1 N (k = 1), 2 N ... on x and torque of as many Nm.
  static std::string force(int k) {
    char text[32];
    std::snprintf(text, sizeof text, "001#%04X753075300000", 30000 + 100 * k);
    return text;
  }
  static std::string torque(int k) {
    char text[32];
    std::snprintf(text, sizeof text, "002#%04X61A861A80000", 25000 + 500 * k);
    return text;
  }
  // The next cycle, a period later.
  void cycle() {
    rig.now_ns += 800 * us;
    CanFrame none;
    EXPECT_FALSE(rig.sensor.poll(rig.now_ns, none)) << "it streams";
  }
};

TEST_F(AidinFaults, ALostHalfNeverMeetsAnothersHalf) {
  rig.take(force(1));
  cycle();
  rig.take(force(2));
  rig.take(torque(2));
  EXPECT_FALSE(rig.sensor.fresh()) << "after a torn sample the order isn't certain";
  cycle();
  rig.take(force(3));
  rig.take(torque(3));
  EXPECT_TRUE(rig.sensor.fresh());
  EXPECT_EQ(rig.sensor.counts().incomplete, 2U);
  cycle();
  rig.take(torque(4));
  EXPECT_FALSE(rig.sensor.fresh());
  cycle();
  rig.take(force(5));
  rig.take(torque(5));
  EXPECT_TRUE(rig.sensor.fresh());
}

TEST_F(AidinFaults, SwappedHalvesAreNoSample) {
  for (int k = 1; k < 20; ++k) {
    rig.take(torque(k));
    rig.take(force(k));
    EXPECT_FALSE(rig.sensor.fresh()) << k;
    cycle();
  }
}

// Force and torque of one sample have the same k, so a mixture is seen at once.
TEST_F(AidinFaults, NoOrderOfFramesMakesAMixture) {
  std::mt19937_64 random(7);
  std::vector<std::string> stream;
  std::uint64_t before = 0;
  for (int k = 0; k < 3000; ++k) {
    std::vector<std::string> both{force(k % 80), torque(k % 80)};
    const auto what = random() % 12;
    if (what == 0) both.erase(both.begin());
    if (what == 1) both.pop_back();
    if (what == 2) std::swap(both[0], both[1]);
    if (what == 3) both.push_back(both.back());
    if (what == 4) both.insert(both.begin(), both.front());
    if (what == 5) both[random() % both.size()].resize(10);
    for (const std::string& frame : both) {
      rig.take(frame);
      if (rig.sensor.latest().number == before) continue;
      before = rig.sensor.latest().number;
      ASSERT_NEAR(rig.sensor.latest().wrench_S[0], rig.sensor.latest().wrench_S[3], 1e-9) << k;
    }
    cycle();
  }
  EXPECT_GT(before, 1500U);
  EXPECT_GT(rig.sensor.counts().wrong_lengths, 0U);
}

TEST_F(AidinFaults, FramesTwiceCountOnce) {
  for (int k = 1; k < 5; ++k) {
    for (const std::string& frame : {force(k), torque(k)}) rig.take(frame), rig.take(frame);
    EXPECT_TRUE(rig.sensor.fresh());
    EXPECT_NEAR(rig.sensor.latest().wrench_S[0], k, 1e-9);
    cycle();
  }
  EXPECT_EQ(rig.sensor.latest().number, 4U);
}

TEST_F(AidinFaults, WrongLengthsAndForeignFramesAreNoSample) {
  EXPECT_TRUE(rig.take("001#7530753075"));
  EXPECT_TRUE(rig.take("001#75307530753000"));
  EXPECT_EQ(rig.sensor.counts().wrong_lengths, 2U);
  EXPECT_FALSE(rig.take("003#7530753075300000"));
  CanFrame wide = frame_of(force(1));
  wide.extended = true;
  EXPECT_FALSE(rig.sensor.on_frame(wide, rig.now_ns));
  wide = frame_of(force(1));
  wide.fd = true;
  EXPECT_TRUE(rig.sensor.on_frame(wide, rig.now_ns));
  EXPECT_TRUE(rig.take(torque(1)));
  EXPECT_FALSE(rig.sensor.fresh());
}

TEST_F(AidinFaults, AFrozenValueIsCounted) {
  for (int i = 0; i < 5; ++i) {
    rig.take(force(3));
    rig.take(torque(3));
    cycle();
  }
  EXPECT_EQ(rig.sensor.latest().repeats, 4U);
  rig.take(force(4));
  rig.take(torque(3));
  EXPECT_EQ(rig.sensor.latest().repeats, 0U);
}

// 0000 and FFFF are the ends of 16 bits; 61A8 + 1 hundredth above 300 N is beyond the range.
TEST_F(AidinFaults, NumbersAtTheirRailsAreSaturated) {
  for (const char* text : {"001#0000753075300000", "001#7530FFFF75300000", "001#75307530EA610000"}) {
    cycle();
    rig.take(text);
    rig.take(torque(0));
    EXPECT_TRUE(rig.sensor.latest().saturated) << text;
  }
  cycle();
  rig.take("001#7530EA6075300000");  // 300.00 N
  rig.take(torque(0));
  EXPECT_FALSE(rig.sensor.latest().saturated);
}

TEST_F(AidinFaults, WhatIsFarTooOldIsDropped) {
  rig.now_ns += 1000 * ms;
  CanFrame none;
  rig.sensor.poll(rig.now_ns, none);
  rig.take(force(1), -30 * ms);
  rig.take(torque(1));
  EXPECT_FALSE(rig.sensor.fresh());
}

TEST_F(AidinFaults, NothingIsAllocatedPerFrame) {
  CanFrame a = frame_of(force(1)), b = frame_of(torque(1)), none;
  const std::uint64_t before = tests::allocation_count();
  for (int i = 0; i < 1000; ++i) {
    rig.sensor.poll(rig.now_ns += ms, none);
    rig.sensor.on_frame(a, rig.now_ns + 1);
    rig.sensor.on_frame(b, rig.now_ns + 2);
  }
  EXPECT_EQ(tests::allocation_count(), before);
}

// ---- What a description can hold besides

const std::string polled_little_endian = R"(
name: own
protocol: described
force_range_N: [1000, 1000, 1000]
torque_range_Nm: [1000, 1000, 1000]
byte_order: little_endian
frames:
  - {id: 0x310, bytes: 8}
  - {id: 0x311, bytes: 8}
poll: {id: 0x300, data: [0x55]}
signals:
  - {byte: 0, bits: 12, type: signed}
  - {byte: 1, bits: 12, shift: 4, type: signed}
  - {byte: 3, bits: 24, type: signed}
  - {byte: 6, bits: 32, type: float}
  - {byte: 10, bits: 16, byte_order: big_endian}
  - {byte: 12, bits: 16}
matrix:
  - [1, 0, 0, 0, 0, 0]
  - [0, 1, 0, 0, 0, 0]
  - [0, 0, 0.001, 0, 0, 1]
  - [0, 0, 0, 1, 0, 0]
  - [0, 0, 0, 0, 1, 0]
  - [0, 0, 0, 0, 0, 2]
checksum: {kind: crc8, byte: 15, from: 0, to: 15, polynomial: 0x1D, initial: 0xFF}
)";

// Bytes 0..2 hold 0x801 (−2047, low nibble of byte 1) and 0x7FE (2046): 01 E8 7F. Then −2 in 24 bits: FE FF FF. The
// float 1.5 is 3FC00000, little-endian 00 00 C0 3F. Big-endian 0102, little-endian 0305 = 05 03, an unused 00. The
// CRC-8 of polynomial 1D and initial value FF over those 15 bytes is CA.
TEST(DescribedSensor, ReadsBitFieldsFloatsAMatrixAndACrc) {
  Rig rig(written(polled_little_endian));
  CanFrame request;
  ASSERT_TRUE(rig.sensor.poll(rig.now_ns, request));
  EXPECT_EQ(text_of(request), "300#55");
  rig.take("310#01E87FFEFFFF0000");
  rig.take("311#C03F010205030014");
  ASSERT_FALSE(rig.sensor.fresh()) << "a wrong CRC";
  rig.take("310#01E87FFEFFFF0000");
  rig.take("311#C03F0102050300CA");
  ASSERT_TRUE(rig.sensor.fresh());
  // fz = −2/1000 + 773, tz = 2 · 773
  expect_wrench(rig.sensor.latest().wrench_S, {-2047, 2046, 772.998, 1.5, 258, 1546});
}

TEST(DescribedSensor, APolledSensorAnswersOncePerPoll) {
  std::string text = polled_little_endian;
  text.resize(text.find("checksum"));
  Rig rig(written(text));
  CanFrame request;
  rig.take("310#0000000000000000");
  rig.now_ns += 900 * us;
  rig.sensor.poll(rig.now_ns, request);
  rig.take("311#0000000000000000");
  EXPECT_FALSE(rig.sensor.fresh()) << "its first half came a period before";
  rig.take("310#0000000000000000");
  rig.take("311#0000000000000000");
  EXPECT_TRUE(rig.sensor.fresh());
  rig.take("310#0100000000000000");
  rig.take("311#0000000000000000");
  EXPECT_EQ(rig.sensor.latest().number, 1U) << "nobody asked for it";
}

// The story: what came between the end of a cycle's waiting and the next poll was dropped, cycle after cycle.
TEST(DescribedSensor, APolledSampleThatIsTooLateForItsCycleIsTakenInTheNext) {
  std::string text = polled_little_endian;
  text.resize(text.find("checksum"));
  Rig rig(written(text));
  CanFrame request;
  const auto late = [&](std::int64_t first_ns, std::int64_t second_ns, const char* first) {
    rig.now_ns += 1000 * us;
    const std::int64_t poll_ns = rig.now_ns;
    rig.sensor.poll(poll_ns, request);
    for (const auto& [frame, after_ns] : {std::pair(first, first_ns), {"311#0000000000000000", second_ns}}) {
      rig.sensor.on_frame(frame_of(frame), poll_ns + after_ns);
    }
  };
  late(-300 * us, -200 * us, "310#0100000000000000");
  EXPECT_TRUE(rig.sensor.fresh());
  EXPECT_FALSE(rig.sensor.answered());
  late(-50 * us, 50 * us, "310#0200000000000000");  // the poll lies between its frames
  EXPECT_TRUE(rig.sensor.fresh());
  EXPECT_TRUE(rig.sensor.latest().late);
  late(100 * us, 200 * us, "310#0300000000000000");
  EXPECT_TRUE(rig.sensor.answered());
  EXPECT_EQ(rig.sensor.counts().late, 2U);
  EXPECT_EQ(rig.sensor.latest().number, 3U);
}

TEST(DescribedSensor, SaysWhatIsWrongAtStart) {
  const auto told = [](const std::vector<std::string>& frames) -> std::string {
    ScriptedNetwork network{{"sensor"}};
    DescribedSensor sensor(shipped("onrobot_hex"), {.bus_name = "sensor", .attempts = 2});
    network.bus(0).on_send = [&](const CanFrame& frame) {
      if (frame.length != 1) return;
      for (const std::string& text : frames) network.bus(0).arrive(text);
    };
    try {
      sensor.start(network, 0);
    } catch (const SetupError& error) {
      return error.what();
    }
    return "started";
  };
  EXPECT_THAT(told({}),
              HasSubstr("OnRobot HEX-E): found no answer, expected a sample of 3 frames from identifier 0x100"));
  EXPECT_THAT(told({"100#AA07081000010000", "100#0000000000000000", "100#0000000000CB"}), HasSubstr("wrong checksum"));
  EXPECT_THAT(told({"100#AA07081000"}), HasSubstr("frames of a wrong length"));
  EXPECT_THAT(told({"100#AA07081000010000"}), HasSubstr("no whole one"));
  EXPECT_THAT(told({"100#AA07081000010400", "100#0000000000000000", "100#0000000000CE"}), HasSubstr("status 0x0400"));
}

TEST(DescribedSensor, RefusesIdentifiersThatArentASensors) {
  EXPECT_THROW(DescribedSensor(shipped("robotous_rft"), {.bus_name = "s", .base_id = 0x1F0}), SetupError);
  EXPECT_THROW(DescribedSensor(shipped("aidin_aft200"), {.bus_name = "s", .base_id = 1}), SetupError);
}

TEST(DescribedSensor, TakesAnyBytes) {
  std::mt19937_64 random(11);
  for (const char* name : {"aidin_aft200", "onrobot_hex"}) {
    Rig rig(shipped(name));
    for (int i = 0; i < 20000; ++i) {
      CanFrame frame;
      frame.id =
          static_cast<std::uint32_t>(random() % 4 == 0 ? random() % 0x800 : 0x100 * (random() % 2) + random() % 3);
      frame.length = static_cast<std::uint8_t>(random() % 9);
      for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random());
      rig.sensor.on_frame(frame, rig.now_ns += static_cast<std::int64_t>(random() % 1000));
    }
    for (const double x : rig.sensor.latest().wrench_S) EXPECT_TRUE(std::isfinite(x));
  }
}

// ---- Bad files

TEST(DescribedSensor, FilesAreRefusedWithTheKey) {
  const auto told = [](const std::string& what, const std::string& instead) -> std::string {
    std::string text = polled_little_endian;
    const std::size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    text.replace(at, what.size(), instead);
    try {
      (void)written(text);
    } catch (const SetupError& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_THAT(told("byte: 12, bits: 16", "byte: 15, bits: 16"), HasSubstr("signals[5].byte"));
  EXPECT_THAT(told("bits: 32, type: float", "bits: 31, type: float"), HasSubstr("signals[3].bits"));
  EXPECT_THAT(told("id: 0x311", "id: 0x310"), HasSubstr("first frame that can be told"));
  EXPECT_THAT(told("id: 0x311", "id: 0x811"), HasSubstr("frames[1].id"));
  EXPECT_THAT(told("bytes: 8}", "bytes: 12}"), HasSubstr("frames[0].bytes"));
  EXPECT_THAT(told("crc8", "crc7"), HasSubstr("checksum.kind"));
  EXPECT_THAT(told("to: 15", "to: 16"), HasSubstr("outside of the bytes"));
  EXPECT_THAT(told("[0, 1, 0, 0, 0, 0]", "[0, 1, 0, 0, 0]"), HasSubstr("matrix[1]"));
  EXPECT_THAT(told("poll: {id: 0x300, data: [0x55]}", ""), HasSubstr("rate_Hz"));
  EXPECT_THAT(told("data: [0x55]", "data: [0x155]"), HasSubstr("poll.data[0]"));
  // One bit can't be two things.
  EXPECT_THAT(told("byte: 12, bits: 16", "byte: 11, bits: 16"), HasSubstr("bits that nothing else has"));
}

}  // namespace
}  // namespace proxarm::fieldbus
