// SocketCanNetwork on a real kernel: run through tests/vcan/with-vcan, which brings vcan0, vcan1, vcan2.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "fieldbus/can/candump_log.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;
using testing::AllOf;
using testing::HasSubstr;

struct Vcan : testing::Test {
  void SetUp() override {
    if (std::getenv("VCAN_USED") == nullptr) GTEST_SKIP() << "needs a real vcan: run by tests/vcan/with-vcan";
  }
  static bool virtual_clock() {
    const char* clock = std::getenv("VCAN_CLOCK");
    return clock != nullptr && std::strcmp(clock, "virtual") == 0;
  }
  static CanFrame frame_of(std::uint32_t id, std::uint8_t length = 0) {
    CanFrame frame;
    frame.id = id;
    frame.length = length;
    for (std::uint8_t i = 0; i < length; ++i) frame.data[i] = static_cast<std::uint8_t>(id + i);
    return frame;
  }
};

TEST_F(Vcan, CarriesEveryKindOfFrame) {
  SocketCanNetwork here({"vcan0"}), there({"vcan0"});
  ASSERT_TRUE(here.carries_fd(0));
  std::vector<CanFrame> sent{frame_of(0x000), frame_of(0x7ff, 8), frame_of(0x1fffffff, 3), frame_of(0x123),
                             frame_of(5, 64)};
  sent[2].extended = true;
  sent[3].remote = true;
  sent[4].fd = sent[4].bit_rate_switch = true;
  for (const CanFrame& frame : sent) {
    ASSERT_EQ(here.bus(0).send(frame), SendResult::sent);
    ASSERT_TRUE(there.wait_for_frame(there.now_ns() + 1'000'000'000));
    TimedFrame timed;
    ASSERT_TRUE(there.bus(0).receive(timed));
    EXPECT_EQ(timed.frame, frame);
    EXPECT_LE(timed.time_ns, there.now_ns());
    EXPECT_GE(timed.time_ns, there.now_ns() - 100'000'000) << "taken over to another clock wrongly";
  }
  TimedFrame timed;
  EXPECT_FALSE(here.bus(0).receive(timed)) << "own frames don't come back";
}

TEST_F(Vcan, LetsOnlyWantedFramesThrough) {
  SocketCanNetwork here({"vcan0"}), there({"vcan0"});
  there.set_filters(0, {{.id = 0x180, .mask = 0x780}});
  CanFrame extended = frame_of(0x181);
  extended.extended = true;
  here.bus(0).send(frame_of(0x200));
  here.bus(0).send(extended);
  here.bus(0).send(frame_of(0x1ff, 1));
  TimedFrame timed;
  ASSERT_TRUE(there.wait_for_frame(there.now_ns() + 1'000'000'000));
  ASSERT_TRUE(there.bus(0).receive(timed));
  EXPECT_EQ(timed.frame.id, 0x1ffu);
  EXPECT_FALSE(there.bus(0).receive(timed));
  there.set_filters(0, {});
  here.bus(0).send(frame_of(0x1ff));
  EXPECT_FALSE(there.wait_for_frame(there.now_ns() + 2'000'000));
}

TEST_F(Vcan, CountsWhatItsBufferCouldNotHold) {
  SocketCanNetwork here({"vcan0"}), there({"vcan0"}, {.receive_buffer_bytes = 20'000});
  for (int i = 0; i < 5000; ++i) here.bus(0).send(frame_of(0x100));
  TimedFrame timed;
  std::uint64_t received = 0;
  while (there.bus(0).receive(timed)) ++received;
  here.bus(0).send(frame_of(0x101));  // the count comes with the next frame
  ASSERT_TRUE(there.wait_for_frame(there.now_ns() + 1'000'000'000));
  while (there.bus(0).receive(timed)) ++received;
  EXPECT_LT(received, 5001u);
  EXPECT_EQ(received + there.bus(0).status().receive_overflows, 5001u);
}

TEST_F(Vcan, HoldsMoreThanTheDefaultBufferWould) {
  SocketCanNetwork here({"vcan0"}), there({"vcan0"});
  for (int i = 0; i < 1000; ++i) here.bus(0).send(frame_of(0x100));
  TimedFrame timed;
  int received = 0;
  while (there.bus(0).receive(timed)) ++received;
  EXPECT_EQ(received, 1000) << "the default of 208 kB ends at 278";
}

TEST_F(Vcan, NoticesThatAnInterfaceGoesDownAndComesUpAgain) {
  SocketCanNetwork here({"vcan2"}), there({"vcan2"});
  ASSERT_EQ(std::system("ip link set down vcan2"), 0);
  EXPECT_EQ(here.bus(0).send(frame_of(1)), SendResult::down);
  EXPECT_FALSE(there.wait_for_frame(there.now_ns() + 5'000'000));
  EXPECT_EQ(there.bus(0).status().state, BusState::down);
  try {
    SocketCanNetwork network({"vcan2"});
    ADD_FAILURE();
  } catch (const SetupError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("vcan2"), HasSubstr("down"), HasSubstr("ip link set up vcan2")));
  }
  ASSERT_EQ(std::system("ip link set up vcan2"), 0);
  EXPECT_EQ(here.bus(0).send(frame_of(1)), SendResult::sent);
  ASSERT_TRUE(there.wait_for_frame(there.now_ns() + 1'000'000'000));
  EXPECT_EQ(there.bus(0).status().state, BusState::error_active);
}

TEST_F(Vcan, SaysWhatIsWrongWithAnInterface) {
  EXPECT_TRUE(is_virtual_can("vcan0"));
  EXPECT_FALSE(is_virtual_can("lo"));
  const auto message_of = [](const std::string& name) -> std::string {
    try {
      SocketCanNetwork network({name});
    } catch (const SetupError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message_of("lo"), HasSubstr("not a CAN one"));
  EXPECT_THAT(message_of("vcan77"), AllOf(HasSubstr("no such"), HasSubstr("vcan0, vcan1, vcan2")));
}

// --- can-utils as independent witnesses

std::string temporary_file(const char* name) {
  return (std::filesystem::temp_directory_path() / ("proxarm_vcan_" + std::to_string(::getpid()) + "_" + name))
      .string();
}

TEST_F(Vcan, HearsACandumpLogThatCanplayerPlays) {
  const std::string path = temporary_file("play.log");
  std::vector<CanFrame> sent{frame_of(0x680, 8), frame_of(0x681, 6), frame_of(0x12345678, 2), frame_of(0x123, 12)};
  sent[2].extended = true;
  sent[3].fd = sent[3].bit_rate_switch = true;
  {
    CandumpLogWriter log(path);
    for (std::size_t i = 0; i < sent.size(); ++i)
      log.write(static_cast<std::int64_t>(i) * 5'000'000, "sensor", sent[i]);
    log.finish();
  }
  SocketCanNetwork network({"vcan0"});
  const std::int64_t start = network.now_ns();
  ASSERT_EQ(std::system(("canplayer -I " + path + " vcan0=sensor").c_str()), 0);
  std::filesystem::remove(path);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    TimedFrame timed;
    ASSERT_TRUE(network.wait_for_frame(network.now_ns() + 1'000'000'000)) << i;
    ASSERT_TRUE(network.bus(0).receive(timed));
    EXPECT_EQ(timed.frame, sent[i]);
    EXPECT_GE(timed.time_ns, start + static_cast<std::int64_t>(i) * 4'000'000)
        << "the time of reception, not of reading";
  }
}

TEST_F(Vcan, SendsWhatCandumpSees) {
  const std::string path = temporary_file("seen.log");
  std::vector<CanFrame> sent{frame_of(0x201, 6), frame_of(0x1abcdef0, 3), frame_of(0x702), frame_of(0x7ff, 64)};
  sent[1].extended = true;
  sent[2].remote = true;
  sent[3].fd = true;
  ASSERT_EQ(std::system(("candump -L -n 4 -T 3000 vcan1 >" + path + " & sleep 0.3").c_str()), 0);
  SocketCanNetwork network({"vcan1"});
  for (const CanFrame& frame : sent) {
    ASSERT_EQ(network.bus(0).send(frame), SendResult::sent);
    network.sleep_until(network.now_ns() + 1'000'000);
  }
  for (int tries = 0; tries < 20 && std::filesystem::file_size(path) == 0; ++tries) {
    network.sleep_until(network.now_ns() + 100'000'000);  // candump flushes as it ends
  }
  network.sleep_until(network.now_ns() + 100'000'000);
  const std::vector<CandumpEntry> seen = read_candump_log(path);
  std::filesystem::remove(path);
  ASSERT_EQ(seen.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(seen[i].frame, sent[i]) << i;
    EXPECT_EQ(seen[i].interface, "vcan1");
    if (i == 0) continue;
    EXPECT_NEAR(static_cast<double>(seen[i].time_ns - seen[i - 1].time_ns), 1e6, virtual_clock() ? 2e5 : 1e8);
  }
}

TEST_F(Vcan, LosesNoWantedFrameInAFloodOfOthers) {
  SocketCanNetwork here({"vcan0"}), there({"vcan0"}, {.receive_buffer_bytes = 20'000});
  there.set_filters(0, {{.id = 0x181, .mask = 0x7ff}});
  ASSERT_EQ(std::system("timeout 0.25 cangen vcan0 -g 0.01 -I 700 -L 8 >/dev/null 2>&1 &"), 0);
  TimedFrame timed;
  int received = 0;
  const std::int64_t start = here.now_ns();
  for (int k = 0; k < 200; ++k) {
    here.sleep_until(start + k * std::int64_t{1'000'000});
    ASSERT_EQ(here.bus(0).send(frame_of(0x181, 8)), SendResult::sent);
    while (there.bus(0).receive(timed)) received += timed.frame.id == 0x181 ? 1 : 1000;
  }
  while (there.wait_for_frame(there.now_ns() + 10'000'000)) {
    while (there.bus(0).receive(timed)) received += timed.frame.id == 0x181 ? 1 : 1000;
  }
  EXPECT_EQ(received, 200);
  EXPECT_EQ(there.bus(0).status().receive_overflows, 0u);
  int flood = 0;
  while (here.bus(0).receive(timed)) ++flood;
  EXPECT_GT(flood, 1000) << "there was no flood";
  here.sleep_until(start + 500'000'000);  // it is over for the tests that follow
}

TEST_F(Vcan, WakesUpForAFrameOrAtTheDeadline) {
  SocketCanNetwork here({"vcan0", "vcan1"}), there({"vcan0", "vcan1"});
  const std::int64_t start = here.now_ns();
  EXPECT_FALSE(there.wait_for_frame(start + 3'000'000));
  EXPECT_GE(there.now_ns(), start + 3'000'000);
  there.sleep_until(start + 5'000'000);
  const std::int64_t late_ns = there.now_ns() - (start + 5'000'000);
  EXPECT_GE(late_ns, 0);
  if (virtual_clock()) {
    EXPECT_LT(late_ns, 100'000) << "timer slack is 50 us";
  }
  here.bus(1).send(frame_of(0x123));
  EXPECT_TRUE(there.wait_for_frame(there.now_ns() + 1'000'000'000)) << "on whichever bus";
  TimedFrame timed;
  EXPECT_FALSE(there.bus(0).receive(timed));
  EXPECT_TRUE(there.bus(1).receive(timed));
}

}  // namespace
}  // namespace proxarm::fieldbus
