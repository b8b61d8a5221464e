#include "fieldbus/simulated/simulated_can_network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "models/base/setup_error.hpp"
#include "tests/allocation_count.hpp"
#include "tests/sanitized.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;
using testing::ElementsAre;
using testing::HasSubstr;

CanFrame frame_of(std::uint32_t id, std::initializer_list<int> bytes = {}, bool extended = false) {
  CanFrame frame;
  frame.id = id;
  frame.extended = extended;
  for (const int byte : bytes) frame.data[frame.length++] = static_cast<std::uint8_t>(byte);
  return frame;
}

struct Node : CanListener {
  std::function<void(const CanFrame&, std::int64_t)> answer;
  std::vector<TimedFrame> seen;
  void on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept override {
    if (answer) {
      answer(frame, time_ns);
    } else {
      seen.push_back({frame, time_ns});
    }
  }
  [[nodiscard]] std::vector<std::uint32_t> ids() const {
    std::vector<std::uint32_t> out;
    for (const auto& timed : seen) out.push_back(timed.frame.id);
    return out;
  }
};

// One bus, two nodes that listen.
struct OneBus : testing::Test {
  SimulatedCanNetwork network{{{.name = "axes"}}};
  SimulatedCanBus& bus = network.simulated_bus(0);
  Node node, other;
  CanPort& port = bus.attach(node, "node");
  CanPort& other_port = bus.attach(other, "other");

  std::vector<std::uint32_t> received_ids() {
    std::vector<std::uint32_t> out;
    TimedFrame timed;
    while (bus.receive(timed)) out.push_back(timed.frame.id);
    return out;
  }
};
using SimulatedCanBusTest = OneBus;

TEST_F(SimulatedCanBusTest, TakesTheFramesOwnTimeOnTheWire) {
  EXPECT_EQ(bus.send(frame_of(0)), SendResult::sent);
  network.sleep_until(1'000'000);
  ASSERT_EQ(node.seen.size(), 1u);
  EXPECT_EQ(node.seen[0].time_ns, 50'000);  // 53 bits at 1 Mbit/s, the last 3 of them silence between frames
  EXPECT_EQ(other.seen.size(), 1u);
  EXPECT_TRUE(received_ids().empty()) << "own frames don't come back";
  EXPECT_EQ(bus.statistics().busy_ns(network.now_ns()), 53'000);
  EXPECT_DOUBLE_EQ(bus.load(), 0.053);
}

TEST_F(SimulatedCanBusTest, StartsTheNextFrameAfterTheInterframeSpace) {
  bus.send(frame_of(0));
  bus.send(frame_of(0));
  network.sleep_until(1'000'000);
  ASSERT_EQ(node.seen.size(), 2u);
  EXPECT_EQ(node.seen[1].time_ns, 53'000 + 50'000);
}

TEST_F(SimulatedCanBusTest, HoldsAnUrgentFrameBackByTheOneOnTheWireOnly) {
  bus.send(frame_of(0x7ff, {1, 2, 3, 4, 5, 6, 7, 8}));
  network.sleep_until(10'000);
  other_port.send(frame_of(0x600));
  port.send(frame_of(0x080));
  network.sleep_until(1'000'000);
  EXPECT_THAT(node.ids(), ElementsAre(0x7ff, 0x600));
  EXPECT_THAT(other.ids(), ElementsAre(0x7ff, 0x080));
  EXPECT_THAT(received_ids(), ElementsAre(0x080, 0x600));
}

TEST_F(SimulatedCanBusTest, LetsAllThatHappensAtTheSameMomentIntoTheArbitration) {
  // The node with the weaker identifier acts first in the order of events.
  network.events().schedule(5'000, [&] { port.send(frame_of(0x300)); });
  network.events().schedule(5'000, [&] { other_port.send(frame_of(0x200)); });
  network.events().schedule(5'000, [&] { bus.send(frame_of(0x100)); });
  std::vector<std::uint32_t> order;
  network.set_observer([&](const WireFrame& wire) { order.push_back(wire.frame.id); });
  network.sleep_until(1'000'000);
  EXPECT_THAT(order, ElementsAre(0x100, 0x200, 0x300));
}

TEST_F(SimulatedCanBusTest, ArbitratesBitByBit) {
  // ISO 11898-1: base identifier, then data before remote, 11 before 29 bits, then the rest of the 29.
  std::vector<CanFrame> expected;
  expected.push_back(frame_of(0x0ff));
  expected.push_back(frame_of(0x0ffu << 18 | 1, {}, true));  // base 0x0ff: beats base 0x100
  expected.push_back(frame_of(0x100));                       // RTR 0
  expected.push_back(frame_of(0x100));
  expected.back().remote = true;                         // RTR 1, IDE 0
  expected.push_back(frame_of(0x100u << 18, {}, true));  // SRR 1, IDE 1
  expected.push_back(frame_of(0x100u << 18, {}, true));
  expected.back().remote = true;
  expected.push_back(frame_of(0x100u << 18 | 1, {}, true));
  expected.push_back(frame_of(0x101));
  std::vector<Node> nodes(expected.size());
  for (std::size_t i = expected.size(); i-- > 0;) {
    bus.attach(nodes[i], "n" + std::to_string(i)).send(expected[i]);
  }
  std::vector<CanFrame> order;
  network.set_observer([&](const WireFrame& wire) { order.push_back(wire.frame); });
  network.sleep_until(10'000'000);
  EXPECT_EQ(order, expected);
}

TEST_F(SimulatedCanBusTest, KeepsAPortsFramesInTheirOrderWhateverTheirIdentifiers) {
  bus.send(frame_of(0x700));
  bus.send(frame_of(0x001));
  port.send(frame_of(0x300));
  network.sleep_until(1'000'000);
  EXPECT_THAT(other.ids(), ElementsAre(0x300, 0x700, 0x001));
}

TEST_F(SimulatedCanBusTest, IsFullAfterTenFramesBehindTheOneInTheController) {
  for (int i = 0; i < 11; ++i) EXPECT_EQ(bus.send(frame_of(0x100)), SendResult::sent) << i;
  EXPECT_EQ(bus.send(frame_of(0x100)), SendResult::queue_full);
  EXPECT_EQ(bus.status().frames_sent, 11u);
  EXPECT_EQ(bus.status().send_failures, 1u);
  network.sleep_until(100'000);
  EXPECT_EQ(bus.send(frame_of(0x100)), SendResult::sent);
  network.sleep_until(10'000'000);
  EXPECT_EQ(node.seen.size(), 12u);
}

TEST(SimulatedCanBus, CountsWhatItsReceiveQueueCannotHold) {
  SimulatedCanNetwork network({{.name = "axes", .receive_queue_length = 3}});
  Node node;
  CanPort& port = network.simulated_bus(0).attach(node, "node");
  for (std::uint32_t i = 0; i < 5; ++i) port.send(frame_of(0x100 + i));
  network.sleep_until(10'000'000);
  EXPECT_EQ(network.bus(0).status().receive_overflows, 2u);
  TimedFrame timed;
  for (std::uint32_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(network.bus(0).receive(timed));
    EXPECT_EQ(timed.frame.id, 0x100 + i) << "the oldest are kept, as in a socket";
  }
  EXPECT_FALSE(network.bus(0).receive(timed));
}

TEST(SimulatedCanBus, RefusesWhatItCannotCarry) {
  SimulatedCanNetwork network({{.name = "classic"}, {.name = "fd", .data_bitrate = 5'000'000}});
  CanFrame frame = frame_of(0x800);
  EXPECT_EQ(network.bus(0).send(frame), SendResult::refused) << "12 bits";
  frame = frame_of(0x20000000, {}, true);
  EXPECT_EQ(network.bus(0).send(frame), SendResult::refused) << "30 bits";
  frame = frame_of(1);
  frame.length = 9;
  EXPECT_EQ(network.bus(0).send(frame), SendResult::refused);
  frame.length = 8;
  frame.fd = true;
  EXPECT_EQ(network.bus(0).send(frame), SendResult::refused) << "FD on a classic bus";
  EXPECT_EQ(network.bus(1).send(frame), SendResult::sent);
  frame.length = 63;
  EXPECT_EQ(network.bus(1).send(frame), SendResult::refused);
  frame.length = 64;
  EXPECT_EQ(network.bus(1).send(frame), SendResult::sent);
  frame.fd = false;
  frame.length = 8;
  EXPECT_EQ(network.bus(1).send(frame), SendResult::sent) << "FD nodes speak classic, too";
}

TEST(SimulatedCanBus, RefusesClassicAndFdNodesOnOneBusWithTheReason) {
  SimulatedCanNetwork network({{.name = "classic"}, {.name = "fd", .data_bitrate = 5'000'000}});
  Node node;
  const auto message_of = [&](std::size_t bus, NodeFormat format) -> std::string {
    try {
      network.simulated_bus(bus).attach(node, "drive 3", format);
    } catch (const SetupError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message_of(0, NodeFormat::fd),
              testing::AllOf(HasSubstr("classic"), HasSubstr("drive 3"), HasSubstr("error frame")));
  EXPECT_THAT(message_of(1, NodeFormat::classic),
              testing::AllOf(HasSubstr("fd"), HasSubstr("drive 3"), HasSubstr("error frame")));
  EXPECT_EQ(message_of(1, NodeFormat::fd), "");
  EXPECT_THAT(message_of(1, NodeFormat::as_bus), HasSubstr("already"));
}

TEST(SimulatedCanBus, SendsTheDataOfAnFdFrameAtItsOwnRate) {
  SimulatedCanNetwork network({{.name = "fd", .data_bitrate = 5'000'000}});
  Node node;
  network.simulated_bus(0).attach(node, "node");
  CanFrame frame = frame_of(0);
  frame.fd = frame.bit_rate_switch = true;
  network.bus(0).send(frame);
  network.sleep_until(1'000'000);
  ASSERT_EQ(node.seen.size(), 1u);
  // 17 + 2 stuff bits + 13, less 3, at 1 Mbit/s; 5 + 27 at 5 Mbit/s.
  EXPECT_EQ(node.seen[0].time_ns, 29'000 + 6'400);
}

TEST(SimulatedCanBus, RefusesBitratesThatCanDoesNotHave) {
  EXPECT_THROW(SimulatedCanNetwork({{.name = "a", .bitrate = 0}}), SetupError);
  EXPECT_THROW(SimulatedCanNetwork({{.name = "a", .bitrate = 2'000'000}}), SetupError);
  EXPECT_THROW(SimulatedCanNetwork({{.name = "a", .data_bitrate = 500'000}}), SetupError);
  EXPECT_THROW(SimulatedCanNetwork({{.name = "a", .data_bitrate = 9'000'000}}), SetupError);
  EXPECT_THROW(SimulatedCanNetwork({{.name = "a"}, {.name = "a"}}), SetupError);
}

TEST_F(SimulatedCanBusTest, WaitsForAFrameOrForTheDeadline) {
  EXPECT_FALSE(network.wait_for_frame(1'000'000));
  EXPECT_EQ(network.now_ns(), 1'000'000);
  port.send(frame_of(0));
  EXPECT_TRUE(network.wait_for_frame(2'000'000));
  EXPECT_EQ(network.now_ns(), 1'050'000);
  EXPECT_TRUE(network.wait_for_frame(2'000'000)) << "it is still there";
  EXPECT_EQ(network.now_ns(), 1'050'000);
  EXPECT_THAT(received_ids(), ElementsAre(0));
  EXPECT_FALSE(network.wait_for_frame(1'000'000)) << "a deadline in the past";
  EXPECT_EQ(network.now_ns(), 1'050'000) << "time doesn't step back";
}

TEST_F(SimulatedCanBusTest, CountsAFrameThatCompletesAtTheDeadlineAsInTime) {
  port.send(frame_of(0));
  EXPECT_TRUE(network.wait_for_frame(50'000));
}

TEST(SimulatedCanBus, DeliversNothingThatNobodyAcknowledges) {
  SimulatedCanNetwork network({{.name = "sensor"}});
  SimulatedCanBus& bus = network.simulated_bus(0);
  for (int i = 0; i < 11; ++i) EXPECT_EQ(bus.send(frame_of(1)), SendResult::sent);
  network.sleep_until(50'000'000);
  EXPECT_EQ(bus.send(frame_of(1)), SendResult::queue_full) << "a controller repeats the first for ever";
  EXPECT_EQ(bus.status().state, BusState::error_passive);
  EXPECT_EQ(bus.status().error_frames, 1u);
  Node node;
  bus.attach(node, "node");
  network.sleep_until(100'000'000);
  EXPECT_EQ(node.seen.size(), 11u);
  EXPECT_EQ(bus.status().state, BusState::error_active);
  bus.set_state("node", BusState::down);
  bus.send(frame_of(2));
  network.sleep_until(200'000'000);
  EXPECT_EQ(bus.status().state, BusState::error_passive);
  bus.set_state("node", BusState::error_active);
  network.sleep_until(300'000'000);
  EXPECT_EQ(node.seen.size(), 12u);
  EXPECT_EQ(bus.status().state, BusState::error_active);
}

TEST_F(SimulatedCanBusTest, AnswersAFrameInTheNextArbitration) {
  node.answer = [&](const CanFrame& frame, std::int64_t) {
    if (frame.id == 0x080) port.send(frame_of(0x181));
  };
  bus.send(frame_of(0x080));
  bus.send(frame_of(0x201));
  network.sleep_until(1'000'000);
  EXPECT_THAT(other.ids(), ElementsAre(0x080, 0x181, 0x201));
}

TEST_F(SimulatedCanBusTest, RemembersTheWorstResponseOfAnIdentifier) {
  port.send(frame_of(0x000));
  other_port.send(frame_of(0x300));
  network.sleep_until(1'000'000);
  other_port.send(frame_of(0x300));
  network.sleep_until(2'000'000);
  const int bits = wire_bits(frame_of(0x300)).total();
  const IdentifierStatistics* statistics = bus.statistics().find(0x300);
  ASSERT_NE(statistics, nullptr);
  EXPECT_EQ(statistics->frames, 2u);
  EXPECT_EQ(statistics->most_bits, bits);
  EXPECT_EQ(statistics->worst_response_ns, (53 + bits - 3) * 1000);
  EXPECT_EQ(bus.statistics().find(0x301), nullptr);
}

TEST_F(SimulatedCanBusTest, FindsTheBusiestWindow) {
  port.send(frame_of(0));
  port.send(frame_of(0));
  network.sleep_until(5'000'000);
  // Across the border of two windows: 26.5 of 53 µs each side, nothing else in them.
  network.sleep_until(5'973'500);
  port.send(frame_of(0));
  network.sleep_until(20'000'000);
  port.send(frame_of(0));
  network.sleep_until(21'000'000);
  EXPECT_DOUBLE_EQ(bus.statistics().peak_load(), 0.106);
  EXPECT_DOUBLE_EQ(bus.load(), 4 * 53e-6 / 21e-3);
  bus.statistics().reset(network.now_ns());
  EXPECT_EQ(bus.load(), 0.0);
}

TEST_F(SimulatedCanBusTest, CountsTwoNodesOnOneIdentifierAsACollision) {
  port.send(frame_of(0x123, {1}));
  other_port.send(frame_of(0x123, {2}));
  network.sleep_until(1'000'000);
  EXPECT_EQ(bus.statistics().collisions(), 1u);
  EXPECT_THAT(received_ids(), ElementsAre(0x123, 0x123));
}

// What is on the wire, re-derived from the log alone: frames don't overlap, each sender's frames keep their order, and
// whoever started had the strongest of all heads that were waiting.
TEST(SimulatedCanBus, ArbitratesCorrectlyUnderRandomTraffic) {
  const unsigned seed = 7;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  SimulatedCanNetwork network({{.name = "axes", .node_transmit_queue_length = 1000}});
  constexpr std::size_t count = 6;
  std::vector<Node> nodes(count);
  std::vector<CanPort*> ports;
  for (std::size_t i = 0; i < count; ++i) {
    ports.push_back(&network.simulated_bus(0).attach(nodes[i], std::to_string(i)));
  }
  struct Sent {
    std::int64_t time;
    std::uint32_t id;
    bool gone = false;
  };
  std::vector<std::vector<Sent>> sent(count);
  for (int i = 0; i < 3000; ++i) {
    const std::int64_t time = static_cast<std::int64_t>(random() % 300'000'000);
    const std::size_t who = random() % count;
    const auto id = static_cast<std::uint32_t>((random() % 300) * count + who);  // no collisions
    network.events().schedule(time, [&, who, id, time] {
      if (ports[who]->send(frame_of(id, {1, 2, 3})) == SendResult::sent) sent[who].push_back({time, id});
    });
  }
  std::int64_t idle = 0;
  std::size_t logged = 0;
  network.set_observer([&](const WireFrame& wire) {
    ++logged;
    ASSERT_GE(wire.start_ns, idle);
    idle = wire.end_ns + 3000;
    ASSERT_EQ(wire.end_ns - wire.start_ns, wire_time_ns(wire.frame, {}) - 3000);
    const std::size_t who = std::stoul(std::string(wire.sender));
    for (std::size_t i = 0; i < count; ++i) {
      const auto head = std::find_if(sent[i].begin(), sent[i].end(), [](const Sent& s) { return !s.gone; });
      if (i == who) {
        ASSERT_NE(head, sent[i].end());
        ASSERT_EQ(head->id, wire.frame.id);
        head->gone = true;
      } else if (head != sent[i].end() && head->time <= wire.start_ns) {
        ASSERT_GT(head->id, wire.frame.id) << "a stronger frame was waiting";
      }
    }
  });
  network.sleep_until(600'000'000);
  EXPECT_EQ(logged, 3000u);
  EXPECT_EQ(network.bus(0).status().frames_received + network.bus(0).status().receive_overflows, 3000u);
  EXPECT_EQ(network.simulated_bus(0).statistics().frames(), 3000u);
}

// --- faults

struct FaultScriptTest : OneBus {
  void apply(FaultRule rule) { network.apply({{std::move(rule)}}); }
};

TEST_F(FaultScriptTest, DropsTheNthFrameOfAnIdentifier) {
  apply({.action = FaultAction::drop, .id = 0x181, .mask = 0x7ff, .first = 2, .count = 1});
  for (int i = 0; i < 3; ++i) {
    port.send(frame_of(0x180));
    port.send(frame_of(0x181, {i}));
  }
  network.sleep_until(10'000'000);
  EXPECT_THAT(received_ids(), ElementsAre(0x180, 0x181, 0x180, 0x180, 0x181));
  EXPECT_EQ(bus.statistics().frames(), 6u) << "it still took its time";
}

TEST_F(FaultScriptTest, DropsForOneReceiverOnly) {
  apply({.action = FaultAction::drop, .receiver = "controller"});
  port.send(frame_of(0x181));
  network.sleep_until(10'000'000);
  EXPECT_THAT(received_ids(), ElementsAre());
  EXPECT_THAT(other.ids(), ElementsAre(0x181));
}

TEST_F(FaultScriptTest, ActsOnlyInItsWindowOfTime) {
  apply({.action = FaultAction::drop, .from_ns = 1'000'000, .to_ns = 2'000'000});
  for (std::uint32_t i = 0; i < 4; ++i) {
    network.sleep_until(i * 500'000);
    port.send(frame_of(i));
  }
  network.sleep_until(2'000'000);
  port.send(frame_of(4));
  network.sleep_until(3'000'000);
  EXPECT_THAT(received_ids(), ElementsAre(0, 1, 4));
}

TEST_F(FaultScriptTest, DelaysPastItsSuccessor) {
  apply({.action = FaultAction::delay, .id = 0x100, .mask = 0x7ff, .delay_ns = 500'000});
  port.send(frame_of(0x100));
  port.send(frame_of(0x101));
  EXPECT_TRUE(network.wait_for_frame(1'000'000));
  TimedFrame timed;
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_EQ(timed.frame.id, 0x101u);
  EXPECT_TRUE(network.wait_for_frame(1'000'000));
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_EQ(timed.frame.id, 0x100u);
  EXPECT_EQ(timed.time_ns, (wire_bits(frame_of(0x100)).total() - 3) * 1000 + 500'000);
}

TEST_F(FaultScriptTest, InvertsBitsAndLeavesWhatIsPastTheEnd) {
  apply({.action = FaultAction::corrupt, .flips = {{0, 7}, {1, 0}, {2, 0}}});
  port.send(frame_of(0x100, {0x00, 0xff}));
  network.sleep_until(1'000'000);
  TimedFrame timed;
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_EQ(timed.frame, frame_of(0x100, {0x80, 0xfe}));
}

TEST_F(FaultScriptTest, CorruptsForOneReceiverOnly) {
  apply({.action = FaultAction::corrupt, .receiver = "other", .flips = {{0, 0}}});
  port.send(frame_of(0x100, {0}));
  network.sleep_until(1'000'000);
  TimedFrame timed;
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_EQ(timed.frame.data[0], 0);
  ASSERT_EQ(other.seen.size(), 1u);
  EXPECT_EQ(other.seen[0].frame.data[0], 1);
}

TEST_F(FaultScriptTest, CutsAFrameShortOrFillsItUp) {
  apply({.action = FaultAction::resize, .id = 0x181, .mask = 0x7ff, .count = 1, .length = 2});
  apply({.action = FaultAction::resize, .id = 0x182, .mask = 0x7ff, .receiver = "controller", .length = 8});
  port.send(frame_of(0x181, {1, 2, 3, 4}));
  port.send(frame_of(0x182, {1, 2, 3, 4}));
  network.sleep_until(1'000'000);
  TimedFrame timed;
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_EQ(timed.frame, frame_of(0x181, {1, 2}));
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_EQ(timed.frame, frame_of(0x182, {1, 2, 3, 4, 0, 0, 0, 0}));
  ASSERT_EQ(other.seen.size(), 2u);
  EXPECT_EQ(other.seen[1].frame.length, 4);
}

TEST_F(FaultScriptTest, ReportsErrorPassiveWhileTheTrafficGoesOn) {
  apply({.action = FaultAction::error_passive, .from_ns = 1'000'000, .to_ns = 2'000'000});
  network.sleep_until(1'500'000);
  EXPECT_EQ(bus.status().state, BusState::error_passive);
  EXPECT_EQ(bus.send(frame_of(1)), SendResult::sent);
  network.sleep_until(2'000'000);
  EXPECT_EQ(bus.status().state, BusState::error_active);
  EXPECT_EQ(node.ids().size(), 1u);
}

TEST_F(FaultScriptTest, DuplicatesOnTheWire) {
  apply({.action = FaultAction::duplicate, .count = 1});
  port.send(frame_of(0x100));
  port.send(frame_of(0x101));
  network.sleep_until(1'000'000);
  EXPECT_THAT(received_ids(), ElementsAre(0x100, 0x100, 0x101));
  EXPECT_EQ(bus.statistics().frames(), 3u);
}

TEST_F(FaultScriptTest, SendsADestroyedFrameAgain) {
  apply({.action = FaultAction::destroy, .count = 2});
  port.send(frame_of(0));
  ASSERT_TRUE(network.wait_for_frame(1'000'000));
  EXPECT_EQ(network.now_ns(), 2 * (53'000 + 17'000) + 50'000);
  EXPECT_THAT(received_ids(), ElementsAre(0));
  EXPECT_EQ(bus.status().error_frames, 2u);
}

// ISO 11898-1: the sender's counter +8 at each error and -1 at each success; warning from 96, passive from 128, bus-off
// above 255. So the 12th, the 16th and the 32nd error frame of one frame.
TEST_F(FaultScriptTest, CountsErrorsAsTheStandardDoes) {
  apply({.action = FaultAction::destroy, .from_ns = 0, .to_ns = 100'000'000, .count = 32});
  bus.send(frame_of(0x100));
  const auto run_until_errors = [&](std::uint64_t errors) {
    while (bus.status().error_frames < errors) network.sleep_until(network.now_ns() + 10'000);
  };
  run_until_errors(11);
  EXPECT_EQ(bus.status().state, BusState::error_active);
  EXPECT_EQ(bus.error_counters("controller").transmit, 88);
  EXPECT_EQ(bus.error_counters("node").receive, 11);
  run_until_errors(12);
  EXPECT_EQ(bus.status().state, BusState::error_warning);
  run_until_errors(16);
  EXPECT_EQ(bus.status().state, BusState::error_passive);
  run_until_errors(31);
  EXPECT_EQ(bus.status().state, BusState::error_passive);
  EXPECT_EQ(bus.error_counters("controller").transmit, 248);
  run_until_errors(32);
  EXPECT_EQ(bus.status().state, BusState::bus_off);
  EXPECT_EQ(bus.send(frame_of(0x100)), SendResult::bus_off);
  network.sleep_until(1'000'000'000);
  EXPECT_EQ(bus.status().state, BusState::bus_off) << "no restart-ms";
  EXPECT_TRUE(node.seen.empty());
}

TEST_F(FaultScriptTest, HealsFrameByFrame) {
  apply({.action = FaultAction::destroy, .count = 15});
  bus.send(frame_of(0x100));
  network.sleep_until(2'000'000);
  EXPECT_EQ(bus.error_counters("controller").transmit, 15 * 8 - 1);
  EXPECT_EQ(bus.status().state, BusState::error_warning);
  for (int i = 0; i < 24; ++i) {
    bus.send(frame_of(0x100));
    network.sleep_until(network.now_ns() + 100'000);
  }
  EXPECT_EQ(bus.error_counters("controller").transmit, 95);
  EXPECT_EQ(bus.status().state, BusState::error_active);
  EXPECT_EQ(bus.error_counters("node").receive, 0);
}

// restart-ms, then 128 times 11 recessive bits. What was in the queue is gone.
TEST(SimulatedCanBus, ComesBackFromBusOffAfterItsRestartTime) {
  SimulatedCanNetwork network({{.name = "axes", .restart_ns = 10'000'000}});
  SimulatedCanBus& bus = network.simulated_bus(0);
  Node node;
  bus.attach(node, "node");
  network.apply({{{.action = FaultAction::destroy, .count = 32}}});
  for (std::uint32_t i = 0; i < 3; ++i) bus.send(frame_of(0x100 + i));
  while (bus.status().state != BusState::bus_off) network.sleep_until(network.now_ns() + 1'000);
  const std::int64_t off_ns = network.now_ns();
  network.sleep_until(off_ns + 10'000'000 + 128 * 11 * 1'000 - 2'000);
  EXPECT_EQ(bus.status().state, BusState::bus_off);
  network.sleep_until(network.now_ns() + 3'000);
  EXPECT_EQ(bus.status().state, BusState::error_active);
  EXPECT_EQ(bus.error_counters("controller").transmit, 0);
  EXPECT_EQ(bus.send(frame_of(0x200)), SendResult::sent);
  network.sleep_until(network.now_ns() + 1'000'000);
  EXPECT_THAT(node.ids(), ElementsAre(0x200));
}

TEST_F(FaultScriptTest, PurgesTheQueueAtBusOffAndRepeatsNothingAfterIt) {
  apply({.action = FaultAction::bus_off, .from_ns = 60'000, .to_ns = 500'000});
  for (std::uint32_t i = 0; i < 4; ++i) bus.send(frame_of(0));
  network.sleep_until(100'000);  // 53 µs: the second frame is cut off
  EXPECT_EQ(bus.status().state, BusState::bus_off);
  EXPECT_EQ(bus.status().error_frames, 1u);
  EXPECT_EQ(bus.send(frame_of(1)), SendResult::bus_off);
  port.send(frame_of(2));
  network.sleep_until(400'000);
  EXPECT_TRUE(received_ids().empty());
  network.sleep_until(600'000);
  EXPECT_EQ(bus.status().state, BusState::error_active);
  EXPECT_EQ(bus.send(frame_of(3)), SendResult::sent);
  network.sleep_until(1'000'000);
  EXPECT_THAT(node.ids(), ElementsAre(0, 3));
}

TEST_F(FaultScriptTest, CutsANodeOff) {
  apply({.action = FaultAction::port_down, .from_ns = 100'000, .port = "node"});
  network.sleep_until(100'000);
  EXPECT_EQ(port.send(frame_of(1)), SendResult::down);
  bus.send(frame_of(2));
  network.sleep_until(1'000'000);
  EXPECT_TRUE(node.seen.empty());
  EXPECT_THAT(other.ids(), ElementsAre(2));
  EXPECT_EQ(bus.status().state, BusState::error_active);
}

TEST_F(FaultScriptTest, BabblesAtTheCostOfWeakerIdentifiers) {
  apply({.action = FaultAction::babble,
         .from_ns = 1'000'000,
         .to_ns = 2'000'000,
         .frame = frame_of(0x001, {0, 0, 0, 0}),
         .period_ns = 10'000});
  network.sleep_until(1'500'000);
  port.send(frame_of(0x100));
  EXPECT_FALSE(other.ids().empty());
  network.sleep_until(1'900'000);
  for (const std::uint32_t id : other.ids()) EXPECT_EQ(id, 0x001u);
  network.sleep_until(5'000'000);
  EXPECT_EQ(other.ids().back(), 0x100u);
  EXPECT_NEAR(bus.statistics().peak_load(), 1.0, 0.1) << "in use without a break";
}

TEST_F(FaultScriptTest, RefusesRulesThatCouldNeverAct) {
  EXPECT_THROW(apply({.bus = "axis"}), SetupError);
  EXPECT_THROW(apply({.bus = "axes", .receiver = "nobody"}), SetupError);
  EXPECT_THROW(apply({.receiver = "nobody"}), SetupError);
  EXPECT_THROW(apply({.action = FaultAction::bus_off, .port = "nobody"}), SetupError);
  EXPECT_THROW(apply({.action = FaultAction::babble, .frame = frame_of(1)}), SetupError) << "no period";
}

// --- as the controller uses it

// Three buses, SYNC, three drives each, a polled sensor: as many frames as a real cell has.
struct CellTraffic {
  SimulatedCanNetwork network{{{.name = "axes_1_3"}, {.name = "axes_4_6"}, {.name = "sensor"}}};
  std::vector<Node> nodes = std::vector<Node>(7);
  std::vector<CanPort*> ports;
  std::uint64_t hash = 14695981039346656037ull;
  std::uint8_t value = 0;

  CellTraffic() {
    for (std::size_t i = 0; i < 6; ++i) {
      ports.push_back(&network.simulated_bus(i / 3).attach(nodes[i], "drive" + std::to_string(i)));
      nodes[i].answer = [this, i](const CanFrame& frame, std::int64_t) {
        if (frame.id == 0x080)
          ports[i]->send(frame_of(0x181 + static_cast<std::uint32_t>(i), {0x37, 0x12, ++value, 2, 3, 4}));
      };
    }
    ports.push_back(&network.simulated_bus(2).attach(nodes[6], "sensor"));
    nodes[6].answer = [this](const CanFrame&, std::int64_t) {
      network.events().schedule_after(20'000, [this] {
        ports[6]->send(frame_of(0x680, {0, 0, 1, ++value, 3, 4, 5, 6}));
        ports[6]->send(frame_of(0x681, {1, 2, 3, 4, 5, 6}));
      });
    };
  }
  // Returns the number of frames received.
  int cycle(std::int64_t t_ns) {
    network.sleep_until(t_ns);
    network.bus(0).send(frame_of(0x080));
    network.bus(1).send(frame_of(0x080));
    network.bus(2).send(frame_of(0x680));
    int received = 0;
    while (received < 8 && network.wait_for_frame(t_ns + 450'000)) {
      for (std::size_t b = 0; b < 3; ++b) {
        TimedFrame timed;
        while (network.bus(b).receive(timed)) {
          ++received;
          for (const std::uint8_t byte : timed.frame.bytes()) hash = (hash ^ byte) * 1099511628211ull;
          hash = (hash ^ static_cast<std::uint64_t>(timed.time_ns)) * 1099511628211ull;
        }
      }
    }
    for (std::uint32_t i = 0; i < 6; ++i) {
      network.bus(i / 3).send(frame_of(0x201 + i, {0x0f, 0, value, 1, 2, 3}));
    }
    return received;
  }
};

TEST(SimulatedCanNetwork, CarriesTheCycleOfACell) {
  CellTraffic cell;
  for (std::int64_t k = 0; k < 100; ++k) ASSERT_EQ(cell.cycle(k * 1'000'000), 8) << k;
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_EQ(cell.network.bus(b).status().send_failures, 0u);
    EXPECT_EQ(cell.network.bus(b).status().receive_overflows, 0u);
  }
  EXPECT_GT(cell.network.simulated_bus(0).load(), 0.5);
  EXPECT_LT(cell.network.simulated_bus(0).statistics().peak_load(), 0.745 + 1e-9) << "the published bound, 745 bits";
}

TEST(SimulatedCanNetwork, IsTheSameInEveryRun) {
  CellTraffic first, second;
  for (std::int64_t k = 0; k < 1000; ++k) {
    first.cycle(k * 1'000'000);
    second.cycle(k * 1'000'000);
  }
  EXPECT_EQ(first.hash, second.hash);
}

TEST(SimulatedCanNetwork, AllocatesNothingInSteadyState) {
  CellTraffic cell;
  cell.network.apply({{{.action = FaultAction::delay, .id = 0x681, .mask = 0x7ff, .delay_ns = 1000}}});
  for (std::int64_t k = 0; k < 10; ++k) cell.cycle(k * 1'000'000);
  const std::uint64_t before = tests::allocation_count();
  for (std::int64_t k = 10; k < 5000; ++k) cell.cycle(k * 1'000'000);
  EXPECT_EQ(tests::allocation_count() - before, 0u);
}

TEST(SimulatedCanNetwork, CostsLittleComparedWithTheCycle) {
  CellTraffic cell;
  for (std::int64_t k = 0; k < 100; ++k) cell.cycle(k * 1'000'000);
  double best_us = 1e9;
  for (std::int64_t pass = 0; pass < 10; ++pass) {
    const auto start = std::chrono::steady_clock::now();
    for (std::int64_t k = 0; k < 200; ++k) cell.cycle((100 + pass * 200 + k) * 1'000'000);
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
    best_us = std::min(best_us, took.count() / 200);
  }
  RecordProperty("us_per_cycle", std::to_string(best_us));
  std::printf("%.2f us per 1 ms cycle of 17 frames on 3 buses\n", best_us);
#if defined(__OPTIMIZE__) && !defined(PROXARM_SANITIZED)
  EXPECT_LT(best_us, 20.0) << "the target is 10; the rest is for slow runners";
#endif
}

TEST(SimulatedCanNetwork, CanFollowRealTime) {
  SimulatedCanNetwork network({{.name = "axes"}});
  Node node;
  CanPort& port = network.simulated_bus(0).attach(node, "node");
  network.follow_real_time();
  const auto start = std::chrono::steady_clock::now();
  network.events().schedule(5'000'000, [&] { port.send(frame_of(1)); });
  EXPECT_TRUE(network.wait_for_frame(20'000'000));
  network.sleep_until(10'000'000);
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(10));
  EXPECT_EQ(network.now_ns(), 10'000'000);
}

TEST(SimulatedCanNetwork, NamesTheBusesItHas) {
  SimulatedCanNetwork network({{.name = "left"}, {.name = "right"}});
  EXPECT_EQ(&network.simulated_bus("right"), &network.bus(1));
  try {
    (void)network.simulated_bus("middle");
    FAIL();
  } catch (const SetupError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("middle"), HasSubstr("left, right")));
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
