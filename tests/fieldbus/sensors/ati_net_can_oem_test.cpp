// Conversations with an ATI Net CAN OEM, written from the maker's protocol: identifiers base << 4 | op, big-endian.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "fieldbus/sensors/ati_net_can_oem.hpp"
#include "models/base/setup_error.hpp"
#include "tests/fieldbus/can/scripted_network.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

constexpr std::int64_t ms = 1'000'000;

// Base id 0x68. The matrix is 1000 on the diagonal but for row fz, whose column SG1 holds −500; 1000 counts/N, 4000
// counts/Nm. 447A0000 is the float 1000, C3FA0000 is −500.
std::vector<std::string> start_conversation() {
  return {"> 68F#",
          "< 68F#0301002A",  // firmware 3.1.42
          "> 685#",
          "< 685#4654313233343500",  // "FT12345"
          "> 682#00",
          "< 682#447A000000000000",
          "< 683#0000000000000000",
          "< 684#0000000000000000",  // fx
          "> 682#01",
          "< 682#00000000447A0000",
          "< 683#0000000000000000",
          "< 684#0000000000000000",  // fy
          "> 682#02",
          "< 682#00000000C3FA0000",
          "< 683#447A000000000000",
          "< 684#0000000000000000",  // fz
          "> 682#03",
          "< 682#0000000000000000",
          "< 683#00000000447A0000",
          "< 684#0000000000000000",  // tx
          "> 682#04",
          "< 682#0000000000000000",
          "< 683#0000000000000000",
          "< 684#447A000000000000",  // ty
          "> 682#05",
          "< 682#0000000000000000",
          "< 683#0000000000000000",
          "< 684#00000000447A0000",  // tz
          "> 687#",
          "< 687#000003E800000FA0",  // 1000, 4000
          "> 688#",
          "< 688#0203",  // N, Nm
          "> 680#",
          "< 680#0000000000000000",
          "< 681#000000000000"};  // a first sample
}

AtiNetCanOemSettings settings() { return {.bus_name = "sensor", .base_id = 0x68}; }

struct AtiNetCanOemTest : ::testing::Test {
  ScriptedNetwork network{{"axes", "sensor"}};
  ScriptedBus& bus = network.bus(1);
  AtiNetCanOem sensor{settings()};

  void start() {
    Conversation c(bus, start_conversation());
    sensor.start(network, 1);
    ASSERT_TRUE(c.complete()) << c.mistakes;
  }
  // Starts with one line of the conversation changed, and returns what the user is told.
  std::string refusal(const std::string& line, const std::string& instead) {
    std::vector<std::string> lines = start_conversation();
    const auto found = std::find(lines.begin(), lines.end(), line);
    EXPECT_NE(found, lines.end()) << line;
    *found = instead;
    lines.erase(std::find_if(found, lines.end(), [](const std::string& l) { return l[0] == '>'; }), lines.end());
    Conversation c(bus, lines);
    try {
      sensor.start(network, 1);
    } catch (const SetupError& error) {
      EXPECT_EQ(error.bus(), "sensor");
      return error.what();
    }
    return "started";
  }
  void poll() {
    network.time_ns += ms;
    CanFrame request;
    ASSERT_TRUE(sensor.poll(network.time_ns, request));
    EXPECT_EQ(text_of(request), "680#");
  }
  bool take(const std::string& frame, std::int64_t after_ns = 100'000) {
    return sensor.on_frame(frame_of(frame), network.time_ns + after_ns);
  }
};

TEST_F(AtiNetCanOemTest, IsAskedForAllThatTheWrenchNeeds) {
  start();
  EXPECT_EQ(sensor.identity(),
            "ATI Net CAN OEM, serial number FT12345, firmware 3.1.42, 1000 counts/N and 4000 counts/Nm");
  EXPECT_EQ(sensor.matrix()[2][1], -500.0);
  EXPECT_EQ(sensor.matrix()[5][5], 1000.0);
  EXPECT_EQ(sensor.counts_per_unit(), (std::array<std::uint32_t, 2>{1000, 4000}));
}

TEST_F(AtiNetCanOemTest, DecodesASampleOfTwoFrames) {
  start();
  poll();
  EXPECT_TRUE(take("680#0000000AFFF60064"));  // SG0 10, SG2 −10, SG4 100
  EXPECT_FALSE(sensor.fresh());
  EXPECT_TRUE(take("681#0014FFEC01F4", 200'000));  // SG1 20, SG3 −20, SG5 500
  ASSERT_TRUE(sensor.fresh());
  EXPECT_EQ(sensor.gauges(), (AtiNetCanOem::Gauges{10, 20, -10, -20, 100, 500}));
  // fx = SG0, fy = SG1, fz = SG2 − SG1/2, tx = SG3/4, ty = SG4/4, tz = SG5/4
  EXPECT_EQ(sensor.latest().wrench_S, (Wrench{10.0, 20.0, -20.0, -5.0, 25.0, 125.0}));
  EXPECT_EQ(sensor.latest().time_ns, network.time_ns + 200'000);
  EXPECT_TRUE(sensor.latest().healthy);
  EXPECT_FALSE(sensor.latest().saturated);
}

TEST_F(AtiNetCanOemTest, NeverMixesHalvesOfTwoSamples) {
  start();
  poll();
  take("680#0000000AFFF60064");
  poll();  // its other half never came
  take("681#0014FFEC01F4");
  EXPECT_FALSE(sensor.fresh()) << "an op 1 without its op 0";
  take("680#0000000100010001");
  take("681#000100010001");
  ASSERT_TRUE(sensor.fresh());
  EXPECT_EQ(sensor.gauges(), (AtiNetCanOem::Gauges{1, 1, 1, 1, 1, 1}));
  EXPECT_EQ(sensor.incomplete_samples(), 1U);
  EXPECT_EQ(sensor.dropped_frames(), 1U);
}

TEST_F(AtiNetCanOemTest, DropsWhatWasOnTheWireBeforeTheLastTwoPolls) {
  start();
  poll();
  poll();
  take("680#00000BAD0BAD0BAD", -1'050'000);
  take("681#0BAD0BAD0BAD", -1'010'000);
  EXPECT_FALSE(sensor.fresh());
  take("681#000100010001");
  EXPECT_FALSE(sensor.fresh());
  EXPECT_EQ(sensor.dropped_frames(), 3U);
}

// The story: samples that came 1.5 ms late were all on the wire between a cycle's last look and the next poll. Each was
// dropped as older than the poll, and the arm stopped after three cycles.
TEST_F(AtiNetCanOemTest, TakesInTheNextCycleWhatWasTooLateForItsOwn) {
  start();
  poll();
  for (int k = 1; k < 5; ++k) {
    poll();
    EXPECT_FALSE(sensor.fresh());
    take("680#0000000" + std::to_string(k) + "00010001", -300'000);  // read after the poll
    take("681#000100010001", -200'000);
    EXPECT_TRUE(sensor.fresh());
    EXPECT_FALSE(sensor.answered()) << "a newer one may come";
    EXPECT_TRUE(sensor.latest().late);
    EXPECT_EQ(sensor.gauges()[0], k);
  }
  EXPECT_EQ(sensor.late_samples(), 4U);
  EXPECT_EQ(sensor.dropped_frames(), 0U);
}

TEST_F(AtiNetCanOemTest, APollsOwnAnswerOutdoesALateOne) {
  start();
  poll();
  poll();
  take("680#0000000100010001", -300'000);
  take("681#000100010001", -200'000);
  take("680#0000000200020002");
  take("681#000200020002", 200'000);
  EXPECT_TRUE(sensor.answered());
  EXPECT_FALSE(sensor.latest().late);
  EXPECT_EQ(sensor.gauges(), (AtiNetCanOem::Gauges{2, 2, 2, 2, 2, 2}));
}

TEST_F(AtiNetCanOemTest, HalvesOnBothSidesOfAPollAreOneSampleIfTheyAreCloseTogether) {
  start();
  poll();
  poll();
  take("680#0000000100010001", -60'000);
  take("681#000100010001", 60'000);
  ASSERT_TRUE(sensor.fresh());
  EXPECT_TRUE(sensor.latest().late);
  poll();
  take("680#0000000200020002", -300'000);  // its partner is lost; that of the next sample follows
  take("681#000300030003", 300'000);
  EXPECT_FALSE(sensor.fresh());
  EXPECT_EQ(sensor.incomplete_samples(), 1U);
}

TEST_F(AtiNetCanOemTest, TakesOneSamplePerPoll) {
  start();
  poll();
  take("680#0000000100010001");
  take("680#0000000200020002");  // a repeated half replaces the first
  take("681#000200020002");
  ASSERT_TRUE(sensor.fresh());
  const std::uint64_t number = sensor.latest().number;
  take("680#0000000300030003");
  take("681#000300030003");
  EXPECT_EQ(sensor.latest().number, number);
  EXPECT_EQ(sensor.gauges(), (AtiNetCanOem::Gauges{2, 2, 2, 2, 2, 2}));
}

TEST_F(AtiNetCanOemTest, DropsWrongLengthsAndForeignFrames) {
  start();
  poll();
  EXPECT_TRUE(take("680#00000001000100"));
  EXPECT_TRUE(take("681#00010001000100"));
  EXPECT_FALSE(take("690#0000000100010001"));
  EXPECT_FALSE(take("670#0000000100010001"));
  EXPECT_FALSE(sensor.fresh());
  EXPECT_EQ(sensor.wrong_lengths(), 2U);
}

TEST_F(AtiNetCanOemTest, NoticesGaugesAtTheirRails) {
  start();
  for (const char* even : {"680#00007FFF00000000", "680#0000000080000000", "680#0000000000008001"}) {
    poll();
    take(even);
    take("681#000000000000");
    EXPECT_TRUE(sensor.latest().saturated) << even;
  }
  poll();
  take("680#00007FFE00000000");
  take("681#000000008002");
  EXPECT_FALSE(sensor.latest().saturated);
}

TEST_F(AtiNetCanOemTest, CountsReadingsThatDoNotChange) {
  start();
  for (int i = 0; i < 4; ++i) {
    poll();
    take("680#0000000100010001");
    take("681#000100010001");
  }
  EXPECT_EQ(sensor.latest().repeats, 3U);
  poll();
  take("680#0000000200010001");
  take("681#000100010001");
  EXPECT_EQ(sensor.latest().repeats, 0U);
}

TEST_F(AtiNetCanOemTest, ReadsItsStatusInWords) {
  EXPECT_EQ(sensor.describe_status(0), "no error");
  EXPECT_EQ(sensor.describe_status(0xC000), "status 0xC000: CAN bus error");
  EXPECT_EQ(sensor.describe_status(0x8840), "status 0x8840: bad active calibration, sensor temperature too high");
  EXPECT_EQ(sensor.describe_status(0x8000), "status 0x8000: error");
  start();
  poll();
  take("680#C000000100010001");
  take("681#000100010001");
  EXPECT_FALSE(sensor.latest().healthy);
}

TEST_F(AtiNetCanOemTest, ASilentSensorIsNamedWithWhatToDo) {
  try {
    sensor.start(network, 1);
    FAIL() << "started";
  } catch (const SetupError& error) {
    EXPECT_EQ(
        std::string(error.what()),
        "bus sensor: force sensor (ATI Net CAN OEM, base id 0x68), firmware version: found no answer, expected an "
        "answer to op 0xF; is it powered, is the base id right, and do bitrate, wiring and both terminations (120 "
        "ohm) fit?");
  }
  EXPECT_EQ(bus.sent.size(), 10U) << "it is asked more than once, since it may be starting up";
}

TEST_F(AtiNetCanOemTest, RefusesWhatGivesNoWrench) {
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(refusal("< 682#447A000000000000", "< 682#7FC0000000000000"), "found nan, expected a finite number");
  has(refusal("< 682#447A000000000000", "< 682#FF80000000000000"), "found -inf, expected a finite number");
  has(refusal("< 687#000003E800000FA0", "< 687#0000000000000FA0"), "counts per force unit: found 0");
  has(refusal("< 687#000003E800000FA0", "< 687#000003E800000000"), "counts per torque unit: found 0");
  has(refusal("< 688#0203", "< 688#0703"), "force unit: found code 7");
  has(refusal("< 688#0203", "< 688#0200"), "torque unit: found code 0");
  has(refusal("< 688#0203", "< 688#02"), "an answer of 1 bytes instead of 2");
  has(refusal("< 68F#0301002A", "< 68E#0301002A"), "found no answer");
}

TEST_F(AtiNetCanOemTest, RefusesASingularMatrix) {
  std::vector<std::string> lines = start_conversation();
  const auto row_fy = std::find(lines.begin(), lines.end(), "< 682#00000000447A0000");
  *row_fy = "< 682#447A000000000000";  // the same as row fx
  lines.erase(std::find(lines.begin(), lines.end(), "> 687#"), lines.end());
  Conversation c(bus, lines);
  try {
    sensor.start(network, 1);
    FAIL() << "started";
  } catch (const SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("found a singular matrix"), std::string::npos) << error.what();
  }
}

TEST_F(AtiNetCanOemTest, ReportsAnErrorOfTheFirstSample) {
  std::vector<std::string> lines = start_conversation();
  lines[lines.size() - 2] = "< 680#8010000000000000";
  Conversation c(bus, lines);
  try {
    sensor.start(network, 1);
    FAIL() << "started";
  } catch (const SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("status word: found status 0x8010: supply voltage too high"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(AtiNetCanOemTest, AsksAgainWhenAnAnswerIsLost) {
  std::vector<std::string> lines = start_conversation();
  const auto lost = std::find(lines.begin(), lines.end(), "< 683#447A000000000000");  // the middle of row fz
  const std::vector<std::string> again = {"> 682#02", "< 682#00000000C3FA0000", "< 683#447A000000000000",
                                          "< 684#0000000000000000"};
  const auto row_tx = lines.erase(lost) + 1;
  lines.insert(row_tx, again.begin(), again.end());
  Conversation c(bus, lines);
  sensor.start(network, 1);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(sensor.matrix()[2][2], 1000.0);
}

TEST_F(AtiNetCanOemTest, ConvertsUnits) {
  std::vector<std::string> lines = start_conversation();
  *std::find(lines.begin(), lines.end(), "< 688#0203") = "< 688#0101";  // lbf, lbf-in
  Conversation c(bus, lines);
  sensor.start(network, 1);
  poll();
  take("680#0000000100000000");
  take("681#000000000004");
  EXPECT_DOUBLE_EQ(sensor.latest().wrench_S[0], 4.4482216152605);     // 1 lbf in N
  EXPECT_DOUBLE_EQ(sensor.latest().wrench_S[5], 0.1129848290276167);  // 1 lbf-in in Nm
}

TEST(AtiNetCanOem, RefusesIdentifiersThatArentASensors) {
  for (const std::uint32_t base : {0x00U, 0x08U, 0x80U}) {
    EXPECT_THROW(AtiNetCanOem({.bus_name = "sensor", .base_id = base}), SetupError) << base;
  }
  const AtiNetCanOem sensor({.bus_name = "sensor", .base_id = 0x68});
  for (const std::uint32_t id : sensor.wanted_ids()) EXPECT_EQ(id & 0x7F0, 0x680U);
}

TEST_F(AtiNetCanOemTest, TakesAnyBytes) {
  start();
  constexpr unsigned seed = 9610;
  std::mt19937 random(seed);
  for (int i = 0; i < 100'000; ++i) {
    if (random() % 3 == 0) poll();
    CanFrame frame;
    frame.id = 0x680 + (random() % 4 == 0 ? random() % 16 : random() % 2);
    frame.length = static_cast<std::uint8_t>(random() % 4 == 0 ? random() % 9 : frame.id % 2 == 0 ? 8 : 6);
    for (std::size_t n = 0; n < frame.length; ++n) frame.data[n] = static_cast<std::uint8_t>(random());
    sensor.on_frame(frame, network.time_ns + static_cast<std::int64_t>(random() % 3) - 1);
    for (const double component : sensor.latest().wrench_S) ASSERT_TRUE(std::isfinite(component));
    ASSERT_FALSE(sensor.describe_status(sensor.latest().status).empty());
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
