// What the arm does when a CAN interface fails under it: controller and simulated arm in one process, with the system
// calls of SocketCAN between them, which fail as the kernel's would (linux/Documentation/networking/can.rst, error
// numbers as raw sockets of Linux 6.12 give them).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/if_arp.h>

#include <cerrno>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

#include "fieldbus/can/can_system.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "tests/controller/closed_loop/closed_loop_stop.hpp"

namespace proxarm::controller {
namespace {

using fieldbus::BusState;
using fieldbus::SimulatedCanNetwork;
using fieldbus::SocketCanNetwork;
using testing::ClosedLoopRig;
using testing::expect_arm_at_rest;
using testing::expect_drives_off;
using testing::expect_targets_run_out;
using testing::failure_ns;
using testing::failure_s;
using ::testing::HasSubstr;
using testing::RigOptions;

constexpr std::int64_t ms = 1'000'000;
// Then drives that don't hear the controller leave NMT operational, and tell no statusword any more.
constexpr std::int64_t heartbeat_timeout_ns = 60 * ms;
constexpr std::int64_t realtime_offset_ns = 1'700'000'000'000'000'000;

// A kernel whose CAN interfaces are the in-process buses, of the same names.
class SystemOnNetwork final : public fieldbus::CanSystem {
 public:
  struct Link {
    int send_error = 0;             // every send fails with this
    int pending_error = 0;          // told once, by the next receive
    bool cut = false;               // nothing arrives
    std::uint32_t dropped = 0;      // SO_RXQ_OVFL
    std::deque<canfd_frame> queue;  // as long as a CAN frame
  };

  explicit SystemOnNetwork(SimulatedCanNetwork& network) : links(network.bus_count()), network_(network) {}

  std::vector<Link> links;

  void error_frame(std::size_t bus, std::uint32_t error_class, std::uint8_t detail = 0) {
    canfd_frame frame{};
    frame.can_id = CAN_ERR_FLAG | error_class;
    frame.len = CAN_ERR_DLC;
    frame.data[1] = detail;
    links[bus].queue.push_back(frame);
  }

  Interface interface(const std::string& name) override {
    for (std::size_t i = 0; i < network_.bus_count(); ++i) {
      if (network_.bus(i).name() == name) return {true, static_cast<unsigned>(i), ARPHRD_CAN, true, CAN_MTU, "can"};
    }
    return {};
  }
  std::string can_interfaces() override { return "those of the network"; }
  int open_raw_can() noexcept override {
    bus_of_.push_back(0);
    return static_cast<int>(bus_of_.size()) - 1;
  }
  int bind_can(int fd, unsigned index) noexcept override {
    bus_of_[static_cast<std::size_t>(fd)] = index;
    return 0;
  }
  int close(int) noexcept override { return 0; }
  int set_option(int, int, int, const void*, unsigned) noexcept override { return 0; }

  int send_many(int fd, mmsghdr* messages, unsigned count) noexcept override {
    const std::size_t bus = bus_of_[static_cast<std::size_t>(fd)];
    for (unsigned i = 0; i < count; ++i) {
      const int error = links[bus].send_error != 0 ? links[bus].send_error : send_one(bus, messages[i]);
      if (error == 0) continue;
      errno = error;
      return i == 0 ? -1 : static_cast<int>(i);
    }
    return static_cast<int>(count);
  }
  int receive_many(int fd, mmsghdr* messages, unsigned count) noexcept override {
    Link& link = links[bus_of_[static_cast<std::size_t>(fd)]];
    collect();
    if (link.pending_error != 0) {
      errno = std::exchange(link.pending_error, 0);
      return -1;
    }
    unsigned got = 0;
    for (; got < count && !link.queue.empty(); ++got) {
      std::memcpy(messages[got].msg_hdr.msg_iov->iov_base, &link.queue.front(), CAN_MTU);
      messages[got].msg_len = CAN_MTU;
      auto* control = static_cast<cmsghdr*>(messages[got].msg_hdr.msg_control);
      control->cmsg_level = SOL_SOCKET;
      control->cmsg_type = SO_RXQ_OVFL;
      control->cmsg_len = CMSG_LEN(sizeof link.dropped);
      std::memcpy(CMSG_DATA(control), &link.dropped, sizeof link.dropped);
      messages[got].msg_hdr.msg_controllen = CMSG_SPACE(sizeof link.dropped);
      link.queue.pop_front();
    }
    if (got == 0) errno = EAGAIN;
    return got == 0 ? -1 : static_cast<int>(got);
  }
  int poll(pollfd* fds, std::size_t count, std::int64_t timeout_ns) noexcept override {
    const std::int64_t deadline_ns = network_.now_ns() + std::max<std::int64_t>(timeout_ns, 0);
    for (;;) {
      const bool more = network_.wait_for_frame(any_ready() ? network_.now_ns() : deadline_ns);
      collect();
      int ready = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const Link& link = links[bus_of_[static_cast<std::size_t>(fds[i].fd)]];
        fds[i].revents = static_cast<short>((link.queue.empty() ? 0 : POLLIN) | (link.pending_error ? POLLERR : 0));
        ready += fds[i].revents != 0;
      }
      if (ready > 0 || !more) return ready;
    }
  }
  std::int64_t clock_ns(clockid_t clock) noexcept override {
    return network_.now_ns() + (clock == CLOCK_REALTIME ? realtime_offset_ns : 0);
  }
  void sleep_until(std::int64_t monotonic_ns) noexcept override { network_.sleep_until(monotonic_ns); }

 private:
  int send_one(std::size_t bus, const mmsghdr& message) noexcept {
    canfd_frame raw{};
    std::memcpy(&raw, message.msg_hdr.msg_iov->iov_base, CAN_MTU);
    fieldbus::CanFrame frame;
    frame.id = raw.can_id & CAN_SFF_MASK;
    frame.length = raw.len;
    std::memcpy(frame.data.data(), raw.data, 8);
    switch (network_.bus(bus).send(frame)) {
      case fieldbus::SendResult::sent:
        return 0;
      case fieldbus::SendResult::queue_full:
      case fieldbus::SendResult::bus_off:
        return ENOBUFS;
      default:
        return ENETDOWN;
    }
  }
  // From the buses into the sockets' buffers.
  void collect() noexcept {
    for (std::size_t i = 0; i < links.size(); ++i) {
      for (fieldbus::TimedFrame timed; network_.bus(i).receive(timed);) {
        if (links[i].cut) continue;
        canfd_frame raw{};
        raw.can_id = timed.frame.id;
        raw.len = timed.frame.length;
        std::memcpy(raw.data, timed.frame.data.data(), 8);
        links[i].queue.push_back(raw);
      }
    }
  }
  [[nodiscard]] bool any_ready() const noexcept {
    return std::any_of(links.begin(), links.end(),
                       [](const Link& link) { return !link.queue.empty() || link.pending_error != 0; });
  }

  SimulatedCanNetwork& network_;
  std::vector<std::size_t> bus_of_;
};

// One session on those interfaces, in which something happens in mid-motion; `bus` 0 and 1 have drives, 2 the sensor.
class InterfaceFault {
 public:
  explicit InterfaceFault(RigOptions options = {})
      : box_(options.settings.period_s, 40), rig(with(options, box_)), system(rig.network) {}

  void at(std::int64_t time_ns, std::function<void()> what) {
    whats_.push_back(std::move(what));
    rig.network.events().schedule(time_ns, [this, i = whats_.size() - 1] { whats_[i](); });
  }
  // From the interface's point of view: ip link set down, and up.
  void down(std::size_t bus) {
    system.links[bus].send_error = system.links[bus].pending_error = ENETDOWN;
    cut(bus, true);
  }
  void up(std::size_t bus) {
    system.links[bus].send_error = 0;
    cut(bus, false);
  }
  // The adapter is pulled: a socket that was bound to it is bound to nothing.
  void remove(std::size_t bus) {
    system.links[bus].pending_error = ENODEV;
    system.links[bus].send_error = ENXIO;
    cut(bus, true);
  }
  void run() {
    std::vector<std::string> names;
    for (const auto& bus : rig.cell.buses) names.push_back(bus.name);
    SocketCanNetwork network(names, {}, system);
    rig.run(network);
    ended_drives_off = rig.cycle->drives_off();
  }

  // Everything at once: the fault and its bus, soon; setpoints run out; the tool neither jumps nor goes on; all drives
  // are off in the end; the record reaches back by more than a second.
  void expect_stop(Fault fault, std::int32_t bus, std::size_t most_cycles) {
    ASSERT_EQ(fault_name(rig.fault().fault), std::string(fault_name(fault)));
    EXPECT_EQ(rig.fault().where, bus);
    const std::size_t failed = rig.cycle_at(failure_s);
    EXPECT_GE(rig.fault().cycle + 1, failed) << "in its receive window at the earliest";
    EXPECT_LE(rig.fault().cycle, failed + most_cycles);
    EXPECT_EQ(rig.cycle->supervisor().phase(), Phase::done);
    // The setpoint of a drive that has stopped by itself follows it, once it can tell where it is.
    expect_targets_run_out(rig, bus == 0 ? std::vector{0, 1, 2} : bus == 1 ? std::vector{3, 4, 5} : std::vector<int>{});
    expect_arm_at_rest(rig, 0.01);
    expect_drives_off(rig);
    // It moves at 0.17 m/s, and its gears ring when drives stop hard; a joint that jumped by 1 mrad in a cycle would
    // make 0.5 m/s or more of it.
    for (std::size_t k = rig.fault().cycle; k < rig.truths.size(); ++k) {
      ASSERT_LT(rig.truths[k].velocity_W.norm(), 0.3) << "cycle " << k;
    }
    expect_record();
  }
  // Describes what the user is told, drives on and off as they were when the session ended.
  [[nodiscard]] std::string told(const std::string& where) const {
    return describe(rig.fault(), where, ended_drives_off);
  }

 private:
  static RigOptions with(RigOptions options, BlackBox& box) {
    options.box = &box;
    return options;
  }
  void cut(std::size_t bus, bool is_cut) {
    system.links[bus].cut = is_cut;
    system.links[bus].queue.clear();
    rig.network.simulated_bus(bus).set_state("controller", is_cut ? BusState::down : BusState::error_active);
  }
  void expect_record() const {
    BoxCycle cycle;
    std::vector<BoxFrame> frames;
    ASSERT_GT(rig.fault().cycle, 1000u);
    for (std::uint64_t k = rig.fault().cycle - 1000; k < rig.records.size(); ++k) {
      ASSERT_TRUE(box_.read(k, cycle, frames)) << "cycle " << k;
      ASSERT_EQ(cycle.record.target_counts, rig.records[k].target_counts) << "cycle " << k;
      ASSERT_GE(frames.size(), k < rig.fault().cycle ? 17u : 1u) << "cycle " << k;
    }
  }

  BlackBox box_;
  std::vector<std::function<void()>> whats_;

 public:
  ClosedLoopRig rig;
  SystemOnNetwork system;
  bool ended_drives_off = false;
};

// The bridge itself: a session on it ends well.
TEST(InterfaceFaults, AreNoneInASessionThatEndsWell) {
  InterfaceFault session({.duration_s = 1.0});
  session.run();
  EXPECT_EQ(session.rig.fault().fault, Fault::none) << fault_name(session.rig.fault().fault);
  EXPECT_EQ(session.rig.cycle->rendered_cycles(), 1000u);
  EXPECT_TRUE(session.ended_drives_off);
}

// ENOBUFS from the first frame of a cycle on. What can't be sent can't stop these drives: their RPDO timer does.
TEST(InterfaceFaults, AFullSendQueueStopsAllWithinACycle) {
  for (const std::size_t bus : {0u, 1u}) {
    SCOPED_TRACE(bus);
    InterfaceFault session;
    session.at(failure_ns, [&] { session.system.links[bus].send_error = ENOBUFS; });
    session.run();
    session.expect_stop(Fault::send_failed, static_cast<std::int32_t>(bus), 1);
    EXPECT_FALSE(session.ended_drives_off) << "nobody could tell them, and none is believed to be off";
    EXPECT_THAT(session.told("bus axes_1_3"),
                AllOf(HasSubstr("queue is full"), HasSubstr("nobody acknowledges"), HasSubstr("keep away")));
  }
}

TEST(InterfaceFaults, AFullSendQueueThatEmptiesAgainDoesNotRestartAnything) {
  InterfaceFault session;
  session.at(failure_ns, [&] { session.system.links[0].send_error = ENOBUFS; });
  session.at(failure_ns + 30 * ms, [&] { session.system.links[0].send_error = 0; });
  session.run();
  session.expect_stop(Fault::send_failed, 0, 1);
  EXPECT_TRUE(session.ended_drives_off) << "they could be told in the end";
}

// SO_RXQ_OVFL: the kernel had no room for frames. It says so with the next one that it had room for.
TEST(InterfaceFaults, AReceiveOverflowStopsAllWithinACycle) {
  for (const std::size_t bus : {0u, 2u}) {
    SCOPED_TRACE(bus);
    InterfaceFault session;
    session.at(failure_ns, [&] { session.system.links[bus].dropped = 7; });
    session.run();
    session.expect_stop(Fault::receive_overflow, static_cast<std::int32_t>(bus), 1);
    EXPECT_EQ(session.rig.fault().value, 7.0);
    EXPECT_TRUE(session.ended_drives_off);
    EXPECT_THAT(session.told("bus sensor"), AllOf(HasSubstr("7 frames"), HasSubstr("floods the bus")));
  }
}

TEST(InterfaceFaults, AnInterfaceThatGoesDownStopsAllWithinACycle) {
  for (const std::size_t bus : {0u, 1u, 2u}) {
    SCOPED_TRACE(bus);
    InterfaceFault session;
    session.at(failure_ns, [&] { session.down(bus); });
    session.run();
    session.expect_stop(Fault::interface_down, static_cast<std::int32_t>(bus), 1);
    EXPECT_EQ(session.ended_drives_off, bus == 2) << "the sensor's bus has no drives";
    EXPECT_THAT(session.told("bus x"), AllOf(HasSubstr("down or was removed"), HasSubstr("ip link")));
  }
}

// Up again while the session waits for its drives to switch off: they are told to, and stay off, whether or not they
// can still say so.
TEST(InterfaceFaults, AnInterfaceThatComesUpAgainDoesNotRestartAnything) {
  for (const std::int64_t pause_ns : {3 * ms, 30 * ms, 300 * ms}) {
    SCOPED_TRACE(pause_ns);
    InterfaceFault session;
    session.at(failure_ns, [&] { session.down(1); });
    session.at(failure_ns + pause_ns, [&] { session.up(1); });
    session.run();
    session.expect_stop(Fault::interface_down, 1, 1);
    EXPECT_EQ(session.ended_drives_off, pause_ns < heartbeat_timeout_ns);
  }
}

TEST(InterfaceFaults, AnInterfaceThatIsRemovedStopsAllWithinACycle) {
  for (const std::size_t bus : {1u, 2u}) {
    SCOPED_TRACE(bus);
    InterfaceFault session;
    session.at(failure_ns, [&] { session.remove(bus); });
    session.run();
    session.expect_stop(Fault::interface_down, static_cast<std::int32_t>(bus), 1);
  }
}

// The kernel's own order of events: error frames warning, passive, bus-off; its queue is purged; after restart-ms the
// interface reports the restart and works again.
TEST(InterfaceFaults, BusOffStopsAllWithinACycleAndItsRestartRestartsNothing) {
  for (const std::int64_t restart_ns : {std::int64_t{0}, 20 * ms, 200 * ms}) {
    SCOPED_TRACE(restart_ns);
    InterfaceFault session;
    const auto set_state = [&](BusState state) { session.rig.network.simulated_bus(0).set_state("controller", state); };
    session.at(failure_ns, [&] {
      session.system.error_frame(0, CAN_ERR_BUSOFF);
      set_state(BusState::bus_off);
    });
    if (restart_ns > 0) {
      session.at(failure_ns + restart_ns, [&] {
        session.system.error_frame(0, CAN_ERR_RESTARTED);
        set_state(BusState::error_active);
      });
    }
    session.run();
    session.expect_stop(Fault::bus_off, 0, 1);
    EXPECT_EQ(session.ended_drives_off, restart_ns > 0 && restart_ns < heartbeat_timeout_ns);
    EXPECT_THAT(session.told("bus axes_1_3"), AllOf(HasSubstr("went off the bus"), HasSubstr("termination")));
  }
}

// By the cell's choice: without one, the arm slows down.
TEST(InterfaceFaults, AnErrorPassiveInterfaceStopsAllWithinACycleAndAWarningStopsNothing) {
  InterfaceFault warned({.duration_s = 2.0});
  warned.at(failure_ns, [&] { warned.system.error_frame(0, CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING); });
  warned.run();
  EXPECT_EQ(warned.rig.fault().fault, Fault::none) << fault_name(warned.rig.fault().fault);
  RigOptions strict;
  strict.edit_cell = [](description::Cell& cell) { cell.supervision.reactions = {{"error_passive", "stop_1"}}; };
  InterfaceFault passive(strict);
  passive.at(failure_ns, [&] { passive.system.error_frame(0, CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE); });
  passive.run();
  passive.expect_stop(Fault::error_passive, 0, 1);
  EXPECT_TRUE(passive.ended_drives_off) << "the bus still works";
}

// --- noise on the in-process bus, with the error counters of ISO 11898-1

// Every SYNC is destroyed: the sender's counter rises by 8 each time, so the controller is error passive after 16 tries
// of 72 bits (1.2 ms), which slows the arm down, and off the bus after 32.
TEST(InterfaceFaults, NoiseTakesABusFromPassiveToOffAndItsRestartRestartsNothing) {
  const auto noise = [](std::int64_t length_ns) {
    return fieldbus::FaultScript{{{.action = fieldbus::FaultAction::destroy,
                                   .bus = "axes_1_3",
                                   .id = 0x080,
                                   .mask = 0x7ff,
                                   .from_ns = failure_ns,
                                   .to_ns = failure_ns + length_ns}}};
  };
  for (const std::int64_t restart_ns : {std::int64_t{0}, 100 * ms}) {
    SCOPED_TRACE(restart_ns);
    BlackBox box(1e-3, 40);
    ClosedLoopRig rig({.script = noise(20 * ms), .restart_ns = restart_ns, .box = &box});
    rig.run();
    ASSERT_EQ(fault_name(rig.fault().fault), std::string("bus_off"));
    EXPECT_GE(rig.cycle->supervisor().notice(Fault::error_passive).times, 1u);
    EXPECT_LE(rig.fault().cycle, rig.cycle_at(failure_s) + 6);
    const BusState state = rig.network.bus(0).status().state;
    EXPECT_EQ(state, restart_ns > 0 ? BusState::error_active : BusState::bus_off);
    expect_targets_run_out(rig);
    expect_arm_at_rest(rig, 0.01);
    expect_drives_off(rig);
  }
}

// Noise that ends in time leaves a bus that heals: counters fall with every frame that comes through.
TEST(InterfaceFaults, AShortBurstOfNoiseIsRiddenThrough) {
  ClosedLoopRig rig(
      {.script = {
           {{.action = fieldbus::FaultAction::destroy, .bus = "axes_1_3", .from_ns = failure_ns, .count = 10}}}});
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  EXPECT_EQ(rig.network.bus(0).status().error_frames, 10u);
  EXPECT_EQ(rig.network.simulated_bus(0).error_counters("controller").transmit, 0);
}

}  // namespace
}  // namespace proxarm::controller
