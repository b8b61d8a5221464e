#include "fieldbus/can/socket_can_network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/if_arp.h>

#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "models/base/setup_error.hpp"
#include "tests/allocation_count.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

// A kernel with vcan0 (FD), can0 (classic), can1 (down) and eth0, whose answers a test can break.
class FakeSystem : public CanSystem {
 public:
  struct Incoming {
    std::vector<std::uint8_t> bytes;
    std::int64_t stamp_ns = 0;  // CLOCK_REALTIME; 0: none
    std::int64_t dropped = -1;  // SO_RXQ_OVFL counter; -1: none
  };

  std::map<std::string, Interface> interfaces{
      {"vcan0", {true, 4, ARPHRD_CAN, true, CANFD_MTU, "vcan"}},
      {"vcan1", {true, 5, ARPHRD_CAN, true, CANFD_MTU, "vcan"}},
      {"can0", {true, 6, ARPHRD_CAN, true, CAN_MTU, "can"}},
      {"can1", {true, 7, ARPHRD_CAN, false, CAN_MTU, "can"}},
      {"slcan0", {true, 8, ARPHRD_CAN, true, CAN_MTU, ""}},
      {"vxcan0", {true, 9, ARPHRD_CAN, true, CANFD_MTU, "vxcan"}},
      {"eth0", {true, 2, ARPHRD_ETHER, true, 1500, ""}},
      {"vcan9", {true, 3, ARPHRD_ETHER, true, 1500, "dummy"}},
  };
  int open_error = 0, write_error = 0, receive_error = 0, refused_option = -1, bind_error = 0;
  int open_sockets = 0;
  std::int64_t monotonic_ns = 1'000'000'000, realtime_ns = 1'700'000'000'000'000'000;
  std::map<int, std::deque<Incoming>> incoming;  // by socket
  std::vector<std::vector<std::uint8_t>> written;
  std::vector<can_filter> filters;
  std::map<int, int> options;
  int receive_calls = 0, send_calls = 0;
  int room = -1;  // frames that the interface's queue still takes; -1: any number

  Interface interface(const std::string& name) override {
    const auto found = interfaces.find(name);
    return found == interfaces.end() ? Interface{} : found->second;
  }
  std::string can_interfaces() override { return "vcan0, can0"; }
  int open_raw_can() noexcept override {
    if (open_error != 0) return fail(open_error);
    ++open_sockets;
    return next_fd_++;
  }
  int bind_can(int, unsigned) noexcept override { return bind_error != 0 ? fail(bind_error) : 0; }
  int close(int) noexcept override {
    --open_sockets;
    return 0;
  }
  int set_option(int, int level, int option, const void* value, unsigned size) noexcept override {
    if (option == refused_option) return fail(EINVAL);
    if (level == SOL_SOCKET && option == SO_RCVBUFFORCE) return fail(EPERM);
    if (level == SOL_CAN_RAW && option == CAN_RAW_FILTER) {
      filters.assign(static_cast<const can_filter*>(value),
                     static_cast<const can_filter*>(value) + size / sizeof(can_filter));
    } else {
      std::memcpy(&options[option], value, sizeof(int));
    }
    return 0;
  }
  // As sendmmsg(): how many it took, or why it didn't take the first.
  int send_many(int, mmsghdr* messages, unsigned count) noexcept override {
    ++send_calls;
    if (write_error != 0) return fail(write_error);
    unsigned taken = 0;
    for (; taken < count && room != 0; ++taken, room -= room > 0 ? 1 : 0) {
      const iovec& from = *messages[taken].msg_hdr.msg_iov;
      const auto* bytes = static_cast<const std::uint8_t*>(from.iov_base);
      written.emplace_back(bytes, bytes + from.iov_len);
    }
    return taken == 0 ? fail(ENOBUFS) : static_cast<int>(taken);
  }
  int receive_many(int fd, mmsghdr* messages, unsigned count) noexcept override {
    ++receive_calls;
    if (receive_error != 0) return fail(std::exchange(receive_error, 0));
    unsigned got = 0;
    auto& queue = incoming[fd];
    while (got < count && !queue.empty()) {
      fill_message(messages[got++], queue.front());
      queue.pop_front();
    }
    return got == 0 ? fail(EAGAIN) : static_cast<int>(got);
  }
  int poll(pollfd* fds, std::size_t count, std::int64_t timeout_ns) noexcept override {
    int ready = 0;
    for (std::size_t i = 0; i < count; ++i) {
      fds[i].revents = 0;
      if (receive_error != 0) fds[i].revents = POLLERR;
      if (!incoming[fds[i].fd].empty()) fds[i].revents = POLLIN;
      ready += fds[i].revents != 0;
    }
    if (ready == 0 && timeout_ns > 0) monotonic_ns += timeout_ns;
    return ready;
  }
  std::int64_t clock_ns(clockid_t clock) noexcept override {
    return clock == CLOCK_REALTIME ? realtime_ns : monotonic_ns;
  }
  void sleep_until(std::int64_t until_ns) noexcept override { monotonic_ns = std::max(monotonic_ns, until_ns); }

 private:
  static int fail(int error) noexcept {
    errno = error;
    return -1;
  }
  static void fill_message(mmsghdr& message, const Incoming& from) {
    std::memcpy(message.msg_hdr.msg_iov->iov_base, from.bytes.data(), from.bytes.size());
    message.msg_len = static_cast<unsigned>(from.bytes.size());
    auto* out = static_cast<char*>(message.msg_hdr.msg_control);
    std::size_t used = 0;
    const auto add = [&](int type, const void* data, std::size_t size) {
      auto* control = reinterpret_cast<cmsghdr*>(out + used);
      control->cmsg_level = SOL_SOCKET;
      control->cmsg_type = type;
      control->cmsg_len = CMSG_LEN(size);
      std::memcpy(CMSG_DATA(control), data, size);
      used += CMSG_SPACE(size);
    };
    if (from.stamp_ns != 0) {
      const timespec stamp{static_cast<std::time_t>(from.stamp_ns / 1'000'000'000),
                           static_cast<long>(from.stamp_ns % 1'000'000'000)};
      add(SO_TIMESTAMPNS, &stamp, sizeof stamp);
    }
    if (from.dropped >= 0) {
      const auto dropped = static_cast<std::uint32_t>(from.dropped);
      add(SO_RXQ_OVFL, &dropped, sizeof dropped);
    }
    message.msg_hdr.msg_controllen = used;
  }
  int next_fd_ = 100;
};

// struct can_frame as the kernel lays it out (x86 and ARM: identifier little-endian).
std::vector<std::uint8_t> raw_classic(std::uint32_t id_and_flags, std::vector<std::uint8_t> data) {
  std::vector<std::uint8_t> out(16, 0);
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<std::uint8_t>(id_and_flags >> (8 * i));
  out[4] = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), out.begin() + 8);
  return out;
}

struct SocketCan : testing::Test {
  FakeSystem system;
  std::unique_ptr<SocketCanNetwork> network =
      std::make_unique<SocketCanNetwork>(std::vector<std::string>{"vcan0"}, SocketCanOptions{}, system);
  CanBus& bus = network->bus(0);

  // The probe took the first socket.
  void arrive(FakeSystem::Incoming incoming, int socket = 101) {
    system.incoming[socket].push_back(std::move(incoming));
  }
};
using SocketCanNetworkTest = SocketCan;

std::string message_of(FakeSystem& system, const std::vector<std::string>& interfaces) {
  try {
    SocketCanNetwork network(interfaces, {}, system);
  } catch (const SetupError& error) {
    EXPECT_EQ(system.open_sockets, 0) << "a socket is left open";
    return error.what();
  }
  return "";
}

TEST(SocketCanSetup, SaysThatTheKernelHasNoCan) {
  FakeSystem system;
  system.open_error = EAFNOSUPPORT;
  EXPECT_THAT(message_of(system, {"vcan0"}), AllOf(HasSubstr("vcan0"), HasSubstr("no CAN"), HasSubstr("modprobe can")));
  EXPECT_THAT(message_of(system, {"nope"}), HasSubstr("kernel has no CAN")) << "not that the interface is missing";
  system.open_error = EPROTONOSUPPORT;
  EXPECT_THAT(message_of(system, {"vcan0"}), HasSubstr("modprobe can-raw"));
  system.open_error = EPERM;
  EXPECT_THAT(message_of(system, {"vcan0"}), HasSubstr("not permitted"));
}

TEST(SocketCanSetup, TellsAMissingInterfaceFromOneThatIsDownOrNoCan) {
  FakeSystem system;
  EXPECT_THAT(message_of(system, {"vcan0", "vcan7"}),
              AllOf(HasSubstr("vcan7"), HasSubstr("no such"), HasSubstr("vcan0, can0")));
  EXPECT_THAT(message_of(system, {"can1"}),
              AllOf(HasSubstr("down"), HasSubstr("ip link set up can1 type can bitrate")));
  EXPECT_THAT(message_of(system, {"eth0"}), AllOf(HasSubstr("eth0"), HasSubstr("not a CAN")));
  system.bind_error = ENODEV;
  EXPECT_THAT(message_of(system, {"vcan0"}), HasSubstr("bind"));
  system.bind_error = 0;
  system.refused_option = SO_RXQ_OVFL;
  EXPECT_THAT(message_of(system, {"vcan0"}), HasSubstr("SO_RXQ_OVFL"));
}

// A cell whose drives and sensor are all on other networks has no CAN bus.
TEST(SocketCanSetup, NeedsNoCanInTheKernelForACellWithoutBuses) {
  FakeSystem system;
  system.open_error = EAFNOSUPPORT;
  SocketCanNetwork network({}, {}, system);
  EXPECT_EQ(network.bus_count(), 0u);
}

TEST(SocketCanSetup, TakesANameGivenTwiceAsOneBus) {
  FakeSystem system;
  SocketCanNetwork network({"vcan0", "vcan1", "vcan0"}, {}, system);
  EXPECT_EQ(network.bus_count(), 2u);
  EXPECT_EQ(network.bus_of(0), 0u);
  EXPECT_EQ(network.bus_of(1), 1u);
  EXPECT_EQ(network.bus_of(2), 0u);
  EXPECT_EQ(network.bus(1).name(), "vcan1");
}

TEST(SocketCanSetup, AsksForWhatACycleNeeds) {
  FakeSystem system;
  SocketCanNetwork network({"vcan0"}, {.receive_buffer_bytes = 123456}, system);
  EXPECT_EQ(system.options[CAN_RAW_ERR_FILTER], static_cast<int>(CAN_ERR_MASK));
  EXPECT_EQ(system.options[SO_RXQ_OVFL], 1);
  EXPECT_EQ(system.options[SO_TIMESTAMPNS], 1);
  EXPECT_EQ(system.options[SO_RCVBUF], 123456) << "where SO_RCVBUFFORCE is not permitted";
}

TEST(SocketCanSetup, IsClosedFromTheStartWhereThatIsWanted) {
  FakeSystem system;
  system.filters.resize(1);
  SocketCanNetwork open({"vcan0"}, {}, system);
  EXPECT_EQ(system.filters.size(), 1u) << "the kernel's own, which pass everything";
  SocketCanNetwork closed({"vcan0"}, {.closed = true}, system);
  EXPECT_TRUE(system.filters.empty());
}

TEST(VirtualCan, GoesByTheKindThatTheKernelSaysNotByTheName) {
  FakeSystem system;
  EXPECT_TRUE(is_virtual_can("vcan0", system));
  EXPECT_TRUE(is_virtual_can("vxcan0", system));
  EXPECT_FALSE(is_virtual_can("can0", system));
  EXPECT_FALSE(is_virtual_can("slcan0", system)) << "a real bus on a serial line";
  EXPECT_FALSE(is_virtual_can("vcan9", system)) << "named like one only";
  EXPECT_FALSE(is_virtual_can("vcan8", system)) << "doesn't exist";
  EXPECT_FALSE(is_virtual_can("lo"));
  EXPECT_FALSE(is_virtual_can(""));
  EXPECT_FALSE(is_virtual_can("a name that no interface can have"));
}

TEST_F(SocketCanNetworkTest, WritesTheKernelsBytes) {
  CanFrame frame;
  frame.id = 0x123;
  frame.length = 2;
  frame.data[0] = 0xde;
  frame.data[1] = 0xad;
  EXPECT_EQ(bus.send(frame), SendResult::sent);
  EXPECT_THAT(system.written[0], ElementsAre(0x23, 0x01, 0, 0, 2, 0, 0, 0, 0xde, 0xad, 0, 0, 0, 0, 0, 0));
  frame.id = 0x1234567;
  frame.extended = true;
  bus.send(frame);
  EXPECT_THAT(system.written[1], ElementsAre(0x67, 0x45, 0x23, 0x81, 2, 0, 0, 0, 0xde, 0xad, 0, 0, 0, 0, 0, 0));
  CanFrame remote;
  remote.id = 0x701;
  remote.remote = true;
  bus.send(remote);
  EXPECT_THAT(system.written[2], ElementsAre(0x01, 0x07, 0, 0x40, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0));
  CanFrame fd;
  fd.id = 0x7ff;
  fd.fd = fd.bit_rate_switch = true;
  fd.length = 12;
  fd.data[11] = 0x77;
  bus.send(fd);
  ASSERT_EQ(system.written[3].size(), 72u);
  EXPECT_EQ(system.written[3][4], 12);
  EXPECT_EQ(system.written[3][5], 0x01) << "CANFD_BRS";
  EXPECT_EQ(system.written[3][19], 0x77);
  EXPECT_EQ(bus.status().frames_sent, 4u);
}

TEST_F(SocketCanNetworkTest, RefusesWhatNoFrameCanBe) {
  CanFrame frame;
  frame.id = 0x800;
  EXPECT_EQ(bus.send(frame), SendResult::refused);
  frame.id = 1;
  frame.length = 9;
  EXPECT_EQ(bus.send(frame), SendResult::refused);
  frame.fd = true;
  EXPECT_EQ(bus.send(frame), SendResult::refused);
  frame.length = 8;
  EXPECT_EQ(bus.send(frame), SendResult::sent);
  SocketCanNetwork classic({"can0"}, {}, system);
  EXPECT_EQ(classic.bus(0).send(frame), SendResult::refused) << "FD on a classic interface";
  EXPECT_FALSE(classic.carries_fd(0));
  EXPECT_EQ(system.written.size(), 1u);
}

TEST_F(SocketCanNetworkTest, TellsAFullQueueFromAnInterfaceThatIsDown) {
  const CanFrame frame{};
  for (const auto& [error, expected] : std::map<int, SendResult>{{ENOBUFS, SendResult::queue_full},
                                                                 {EAGAIN, SendResult::queue_full},
                                                                 {ENETDOWN, SendResult::down},
                                                                 {ENXIO, SendResult::down},
                                                                 {ENODEV, SendResult::down}}) {
    system.write_error = error;
    EXPECT_EQ(bus.send(frame), expected) << std::strerror(error);
  }
  EXPECT_EQ(bus.status().state, BusState::down);
  EXPECT_EQ(bus.status().send_failures, 5u);
  system.write_error = 0;
  EXPECT_EQ(bus.send(frame), SendResult::sent) << "set up again";
  EXPECT_EQ(bus.status().state, BusState::error_active);
}

TEST_F(SocketCanNetworkTest, SendsACyclesFramesInOneCall) {
  std::vector<CanFrame> frames(40);
  for (std::uint32_t i = 0; i < 40; ++i) frames[i].id = i;
  std::vector<SendResult> results(40, SendResult::down);
  bus.send_all(frames, 0, results.data());
  EXPECT_EQ(system.send_calls, 2) << "32 in a batch";
  EXPECT_THAT(results, testing::Each(SendResult::sent));
  ASSERT_EQ(system.written.size(), 40u);
  for (std::uint32_t i = 0; i < 40; ++i) EXPECT_EQ(system.written[i][0], i) << "in their order";
  EXPECT_EQ(bus.status().frames_sent, 40u);
}

// sendmmsg() that takes two of five and then says ENOBUFS once asked for the third: each frame has its own result, and
// one that no kernel would take doesn't cost the others theirs.
TEST_F(SocketCanNetworkTest, TellsWhichOfACyclesFramesWentAndWhichDidNot) {
  std::vector<CanFrame> frames(6);
  for (std::uint32_t i = 0; i < 6; ++i) frames[i].id = 0x201 + i;
  frames[1].id = 0x800;
  system.room = 2;
  std::vector<SendResult> results(6, SendResult::sent);
  bus.send_all(frames, 0, results.data());
  const auto full = SendResult::queue_full;
  EXPECT_THAT(results, ElementsAre(SendResult::sent, SendResult::refused, SendResult::sent, full, full, full));
  ASSERT_EQ(system.written.size(), 2u);
  EXPECT_EQ(system.written[1][0], 0x03);
  EXPECT_EQ(bus.status().frames_sent, 2u);
  EXPECT_EQ(bus.status().send_failures, 4u);
  system.room = -1;
  bus.send_all(frames, 0, results.data());
  EXPECT_EQ(system.written.size(), 7u) << "nothing is sent twice";
}

TEST_F(SocketCanNetworkTest, DecodesTheKernelsBytesAndTheirTime) {
  const std::int64_t stamp = system.realtime_ns - 250'000;  // received 0.25 ms ago
  arrive({raw_classic(0x181, {0x37, 0x12, 1, 2, 3, 4}), stamp});
  arrive({raw_classic(0x9234567 | CAN_EFF_FLAG, {9}), stamp + 1000});
  arrive({raw_classic(0x702 | CAN_RTR_FLAG, {}), stamp + 2000});
  std::vector<std::uint8_t> fd(72, 0);
  fd[0] = 0x11;
  fd[4] = 64;
  fd[5] = CANFD_BRS;
  fd[71] = 0xee;
  arrive({fd, stamp + 3000});
  ASSERT_TRUE(network->wait_for_frame(2'000'000'000));
  TimedFrame timed;
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_EQ(timed.frame.id, 0x181u);
  EXPECT_EQ(timed.frame.length, 6);
  EXPECT_EQ(timed.frame.data[1], 0x12);
  EXPECT_EQ(timed.time_ns, system.monotonic_ns - 250'000);
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_TRUE(timed.frame.extended);
  EXPECT_EQ(timed.frame.id, 0x9234567u);
  EXPECT_EQ(timed.time_ns, system.monotonic_ns - 249'000);
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_TRUE(timed.frame.remote);
  EXPECT_EQ(timed.frame.id, 0x702u);
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_TRUE(timed.frame.fd);
  EXPECT_TRUE(timed.frame.bit_rate_switch);
  EXPECT_EQ(timed.frame.length, 64);
  EXPECT_EQ(timed.frame.data[63], 0xee);
  EXPECT_FALSE(bus.receive(timed));
  EXPECT_EQ(bus.status().frames_received, 4u);
}

TEST_F(SocketCanNetworkTest, GivesNoTimeInTheFutureAndNoneThatStepsBack) {
  arrive({raw_classic(1, {}), system.realtime_ns - 1000});
  arrive({raw_classic(2, {}), system.realtime_ns - 3'600'000'000'000});  // CLOCK_REALTIME was set in between
  arrive({raw_classic(3, {}), system.realtime_ns + 3'600'000'000'000});
  arrive({raw_classic(4, {}), 0});
  TimedFrame timed;
  std::vector<std::int64_t> ages;
  while (bus.receive(timed)) ages.push_back(system.monotonic_ns - timed.time_ns);
  EXPECT_THAT(ages, ElementsAre(1000, 1000, 0, 0));
}

TEST_F(SocketCanNetworkTest, CountsWhatTheKernelDropped) {
  arrive({raw_classic(1, {}), 0, 5});
  arrive({raw_classic(1, {}), 0, 5});
  arrive({raw_classic(1, {}), 0, 8});
  TimedFrame timed;
  while (bus.receive(timed)) {
  }
  EXPECT_EQ(bus.status().receive_overflows, 8u);
  arrive({raw_classic(1, {}), 0, 0xffffffff});
  arrive({raw_classic(1, {}), 0, 1});  // its counter has 32 bits
  while (bus.receive(timed)) {
  }
  EXPECT_EQ(bus.status().receive_overflows, 0x100000001ull);
}

// Byte layouts: linux/can/error.h.
TEST_F(SocketCanNetworkTest, FollowsTheStateOfTheBusByErrorFrames) {
  const auto state_after = [&](std::uint32_t error_class, std::uint8_t detail) {
    arrive({raw_classic(CAN_ERR_FLAG | error_class, {0, detail, 0, 0, 0, 0, 0, 0})});
    TimedFrame timed;
    EXPECT_FALSE(bus.receive(timed)) << "an error frame is not a frame";
    return bus.status().state;
  };
  EXPECT_EQ(state_after(0x004, 0x08), BusState::error_warning);  // transmit errors above 96
  EXPECT_EQ(state_after(0x004, 0x20), BusState::error_passive);
  EXPECT_EQ(state_after(0x004, 0x40), BusState::error_active);
  EXPECT_EQ(state_after(0x004, 0x04), BusState::error_warning);  // receive errors
  EXPECT_EQ(state_after(0x004, 0x10), BusState::error_passive);
  EXPECT_EQ(state_after(0x020, 0x00), BusState::error_passive);  // no acknowledge: says nothing of the state
  EXPECT_EQ(state_after(0x040, 0x00), BusState::bus_off);
  EXPECT_EQ(bus.send(CanFrame{}), SendResult::bus_off);
  EXPECT_TRUE(system.written.empty());
  EXPECT_EQ(state_after(0x100, 0x00), BusState::error_active);  // restarted
  EXPECT_EQ(bus.send(CanFrame{}), SendResult::sent);
  EXPECT_EQ(bus.status().receive_overflows, 0u);
  state_after(0x004, 0x01);  // the CAN controller's own overflow
  EXPECT_EQ(bus.status().receive_overflows, 1u);
  EXPECT_EQ(bus.status().error_frames, 9u);
  EXPECT_EQ(bus.status().frames_received, 0u);
}

TEST_F(SocketCanNetworkTest, WaitsOnWhenOnlyErrorFramesCome) {
  arrive({raw_classic(CAN_ERR_FLAG | CAN_ERR_ACK, std::vector<std::uint8_t>(8))});
  EXPECT_FALSE(network->wait_for_frame(system.monotonic_ns + 5'000'000));
  EXPECT_EQ(system.monotonic_ns, 1'005'000'000);
  EXPECT_FALSE(network->wait_for_frame(0)) << "a deadline in the past";
  arrive({raw_classic(1, {})});
  EXPECT_TRUE(network->wait_for_frame(0)) << "what is there is there";
}

TEST_F(SocketCanNetworkTest, NoticesAnInterfaceThatGoesDown) {
  system.receive_error = ENETDOWN;
  EXPECT_FALSE(network->wait_for_frame(system.monotonic_ns + 1'000'000));
  EXPECT_EQ(bus.status().state, BusState::down);
  arrive({raw_classic(1, {})});
  EXPECT_TRUE(network->wait_for_frame(system.monotonic_ns + 1'000'000));
  EXPECT_EQ(bus.status().state, BusState::error_active) << "up again";
}

TEST_F(SocketCanNetworkTest, ReadsInBatchesAndLosesNothingBetweenThem) {
  for (std::uint32_t i = 0; i < 100; ++i) arrive({raw_classic(i, {})});
  TimedFrame timed;
  std::uint32_t next = 0;
  ASSERT_TRUE(network->wait_for_frame(0));
  while (bus.receive(timed)) {
    ASSERT_EQ(timed.frame.id, next++);
    if (next == 50) arrive({raw_classic(100, {})});
  }
  EXPECT_EQ(next, 101u);
  EXPECT_LE(system.receive_calls, 4);
  // A loop that polls without waiting hears of new frames, too.
  arrive({raw_classic(7, {})});
  EXPECT_TRUE(bus.receive(timed) || bus.receive(timed));
}

TEST_F(SocketCanNetworkTest, IgnoresWhatHasNoFramesLength) {
  arrive({std::vector<std::uint8_t>(15, 1)});
  auto too_long = raw_classic(5, {1});
  too_long[4] = 200;  // a length past the data
  arrive({too_long});
  TimedFrame timed;
  ASSERT_TRUE(bus.receive(timed));
  EXPECT_EQ(timed.frame.id, 5u);
  EXPECT_EQ(timed.frame.length, 8);
  EXPECT_FALSE(bus.receive(timed));
}

TEST_F(SocketCanNetworkTest, FiltersByIdentifierAndItsLength) {
  network->set_filters(0, {{.id = 0x181, .mask = 0x7ff}, {.id = 0x12345, .extended = true}});
  ASSERT_EQ(system.filters.size(), 2u);
  EXPECT_EQ(system.filters[0].can_id, 0x181u);
  EXPECT_EQ(system.filters[0].can_mask, 0x7ffu | CAN_EFF_FLAG) << "29-bit identifiers don't pass";
  EXPECT_EQ(system.filters[1].can_id, 0x12345u | CAN_EFF_FLAG);
  EXPECT_EQ(system.filters[1].can_mask, 0x1fffffffu | CAN_EFF_FLAG);
  system.refused_option = CAN_RAW_FILTER;
  EXPECT_THROW(network->set_filters(0, {}), SetupError);
}

TEST_F(SocketCanNetworkTest, NeitherAllocatesWhileItSendsAndReceives) {
  CanFrame frame;
  frame.id = 0x201;
  frame.length = 6;
  system.write_error = ENOBUFS;  // the fake itself would allocate
  TimedFrame timed;
  for (int i = 0; i < 64; ++i) arrive({raw_classic(0x181, {1, 2, 3})});
  std::uint64_t allocated = 0;
  for (int i = 0; i < 64; ++i) {
    const std::uint64_t before = tests::allocation_count();
    bus.send(frame);
    bus.receive(timed);
    allocated += tests::allocation_count() - before;
  }
  EXPECT_EQ(allocated, 0u);
}

}  // namespace
}  // namespace proxarm::fieldbus
