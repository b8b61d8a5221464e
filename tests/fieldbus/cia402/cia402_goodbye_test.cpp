// The last words to drives: exact bytes (CiA 301, 7.2.4.3.3), and to whom they go.
#include "fieldbus/cia402/cia402_goodbye.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/fieldbus/can/scripted_network.hpp"
#include "tests/fieldbus/cia402/described_drive.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::int64_t ms = 1'000'000;

class GoodbyeTest : public ::testing::Test {
 protected:
  GoodbyeTest() : one(drive_of(1), {}), two(drive_of(2), {}), goodbye(slots()) { goodbye.begin(0); }
  std::vector<DriveSlot> slots() { return {{&one, 0}, {&two, 0}}; }

  // Statusword and a position, as each SYNC's TPDO1 has them.
  void says(std::uint8_t node, const char* statusword) {
    ServoDrive& drive = node == 1 ? one : two;
    EXPECT_TRUE(drive.on_frame(frame_of("18" + std::to_string(node) + "#" + statusword + "00000000"), now_ns));
  }
  std::string request() {
    CanFrame frame;
    std::size_t bus = 9;
    if (!goodbye.next_request(now_ns, bus, frame)) return "";
    EXPECT_EQ(bus, 0u);
    return text_of(frame);
  }
  void expect(const char* wanted, const char* answer) {
    EXPECT_EQ(request(), wanted);
    EXPECT_EQ(request(), "") << "one at a time on a bus";
    EXPECT_TRUE(goodbye.on_frame(0, frame_of(answer)));
  }

  ServoDrive one, two;
  Goodbye goodbye;
  std::int64_t now_ns = 0;
};

constexpr const char *enabled = "2700", *ready = "2100", *disabled = "4000", *fault = "0800";

TEST_F(GoodbyeTest, TellsEachDriveThatIsOffToWaitForNoHeartbeatAndNoSync) {
  says(1, disabled);
  says(2, disabled);
  expect("601#2316100100000000", "581#6016100100000000");
  expect("601#2306100000000000", "581#6006100000000000");
  EXPECT_FALSE(goodbye.done(now_ns));
  expect("602#2316100100000000", "582#6016100100000000");
  expect("602#2306100000000000", "582#6006100000000000");
  EXPECT_TRUE(goodbye.done(now_ns));
  EXPECT_EQ(request(), "");
}

TEST_F(GoodbyeTest, TellsADriveInFaultTheSame) {
  says(1, fault);
  says(2, disabled);
  EXPECT_EQ(request(), "601#2316100100000000");
}

// It must stop by itself when the heartbeat ends.
TEST_F(GoodbyeTest, TellsADriveThatIsStillEnabledNothing) {
  says(1, enabled);
  says(2, disabled);
  expect("602#2316100100000000", "582#6016100100000000");
  expect("602#2306100000000000", "582#6006100000000000");
  for (; now_ns < 299 * ms; now_ns += ms) {
    ASSERT_EQ(request(), "");
    ASSERT_FALSE(goodbye.done(now_ns));
  }
  EXPECT_TRUE(goodbye.done(300 * ms));
}

TEST_F(GoodbyeTest, TellsNobodyWhoHasNeverSaidAnything) {
  for (; now_ns < 300 * ms; now_ns += ms) ASSERT_EQ(request(), "");
  EXPECT_TRUE(goodbye.done(now_ns));
}

// The next SYNC takes it to switch on disabled; some stay, and have no power either.
TEST_F(GoodbyeTest, WaitsForADriveThatIsReadyToSwitchOnButNotForEver) {
  says(1, ready);
  says(2, ready);
  now_ns = 99 * ms;
  EXPECT_EQ(request(), "");
  says(2, disabled);
  EXPECT_EQ(request(), "602#2316100100000000");
  EXPECT_TRUE(goodbye.on_frame(0, frame_of("582#6016100100000000")));
  now_ns = 100 * ms;
  EXPECT_EQ(request(), "601#2316100100000000");
}

TEST_F(GoodbyeTest, LeavesAtThatWhatADriveRefusesOrDoesNotAnswer) {
  says(1, disabled);
  says(2, disabled);
  expect("601#2316100100000000", "581#8016100101000106");  // abort 06010001h
  expect("601#2306100000000000", "581#8006100000000206");  // 06020000h: it hasn't got 1006h
  EXPECT_EQ(request(), "602#2316100100000000");
  now_ns = 49 * ms;
  EXPECT_EQ(request(), "");
  now_ns = 50 * ms;
  EXPECT_EQ(request(), "602#2306100000000000");
  now_ns = 100 * ms;
  EXPECT_EQ(request(), "");
  EXPECT_TRUE(goodbye.done(now_ns));
}

TEST_F(GoodbyeTest, TakesOnlyAnswersToWhatItAsked) {
  says(1, disabled);
  EXPECT_EQ(request(), "601#2316100100000000");
  EXPECT_TRUE(goodbye.on_frame(0, frame_of("581#6017100000000000"))) << "an answer that comes late";
  EXPECT_EQ(request(), "");
  EXPECT_FALSE(goodbye.on_frame(1, frame_of("581#6016100100000000"))) << "another bus";
  EXPECT_FALSE(goodbye.on_frame(0, frame_of("181#400000000000")));
  EXPECT_EQ(request(), "");
  EXPECT_TRUE(goodbye.on_frame(0, frame_of("581#6016100100000000")));
  EXPECT_EQ(request(), "601#2306100000000000");
}

}  // namespace
}  // namespace proxarm::fieldbus
