// What the fieldbus adds to the system calls that a cycle can't do without: six drives on two interfaces and a sensor
// on a third, bytes in to bytes out, against a loop that reads and writes the same frames with recvmmsg and sendmmsg
// and does nothing else. Both, and the peer that feeds them, on a real kernel; no clock is read but between batches.
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <string>
#include <vector>

#include "fieldbus/can/socket_can_network.hpp"
#include "fieldbus/cia402/cia402_drive.hpp"
#include "fieldbus/sensors/described_sensor.hpp"
#include "tests/allocation_count.hpp"
#include "tests/source_file.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr int batches = 120, cycles_per_batch = 100;  // of each kind; 12,000 cycles

can_frame raw(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
  can_frame frame{};
  frame.can_id = id;
  frame.len = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), frame.data);
  return frame;
}

// A socket with as few options as will do, and room to read and write eight frames at once.
class BareSocket {
 public:
  BareSocket(const std::string& interface, const std::vector<can_filter>& filters)
      : fd_(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW)) {
    const auto size = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
    ::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), size);
    const int bytes = 4 << 20;
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
    ok_ = ::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    for (std::size_t i = 0; i < headers_.size(); ++i) {
      vectors_[i] = {&frames_[i], sizeof(can_frame)};
      headers_[i].msg_hdr.msg_iov = &vectors_[i];
      headers_[i].msg_hdr.msg_iovlen = 1;
    }
  }
  BareSocket(const BareSocket&) = delete;
  BareSocket& operator=(const BareSocket&) = delete;
  ~BareSocket() { ::close(fd_); }

  [[nodiscard]] bool ok() const { return ok_; }
  int read() { return ::recvmmsg(fd_, headers_.data(), 8, MSG_DONTWAIT, nullptr); }
  int write(const std::vector<can_frame>& frames) {
    std::copy(frames.begin(), frames.end(), frames_.begin());
    return ::sendmmsg(fd_, headers_.data(), static_cast<unsigned>(frames.size()), MSG_DONTWAIT);
  }

 private:
  int fd_;
  bool ok_ = false;
  std::array<can_frame, 8> frames_{};
  std::array<iovec, 8> vectors_{};
  std::array<mmsghdr, 8> headers_{};
};

std::vector<can_filter> only(std::initializer_list<std::uint32_t> ids) {
  std::vector<can_filter> filters;
  for (const std::uint32_t id : ids) filters.push_back({id, CAN_SFF_MASK | CAN_EFF_FLAG});
  return filters;
}

// What comes in and goes out in a cycle, by interface: drives 1 to 3, 4 to 6, the sensor.
const std::array<std::vector<can_frame>, 3> incoming{
    {{raw(0x181, {0x37, 0x12, 1, 0, 0, 0}), raw(0x182, {0x37, 0x12, 2, 0, 0, 0}), raw(0x183, {0x37, 0x12, 3, 0, 0, 0})},
     {raw(0x184, {0x37, 0x12, 4, 0, 0, 0}), raw(0x185, {0x37, 0x12, 5, 0, 0, 0}), raw(0x186, {0x37, 0x12, 6, 0, 0, 0})},
     {raw(0x001, {0x75, 0x30, 0x75, 0x30, 0x75, 0x30, 0, 0}), raw(0x002, {0x61, 0xA8, 0x61, 0xA8, 0x61, 0xA8, 0, 0})}}};

class Peer {
 public:
  explicit Peer(const std::array<std::string, 3>& interfaces)
      : sockets_{{{interfaces[0], {}}, {interfaces[1], {}}, {interfaces[2], {}}}} {}
  void feed() {
    for (std::size_t i = 0; i < 3; ++i) sockets_[i].write(incoming[i]);
  }

 private:
  std::array<BareSocket, 3> sockets_;
};

class BareLoop {
 public:
  explicit BareLoop(const std::array<std::string, 3>& interfaces)
      : sockets_{{{interfaces[0], only({0x181, 0x182, 0x183})},
                  {interfaces[1], only({0x184, 0x185, 0x186})},
                  {interfaces[2], only({0x001, 0x002})}}} {}
  [[nodiscard]] bool ok() const {
    return std::all_of(sockets_.begin(), sockets_.end(), [](const BareSocket& s) { return s.ok(); });
  }
  void begin() {
    for (std::size_t i = 0; i < 2; ++i) sockets_[i].write(sync_);
  }
  int end() {
    int frames = 0;
    for (BareSocket& socket : sockets_) frames += std::max(0, socket.read());
    for (std::size_t i = 0; i < 2; ++i) sockets_[i].write(targets_[i]);
    return frames;
  }
  int drain() {
    int frames = 0;
    for (BareSocket& socket : sockets_) {
      for (int got = socket.read(); got > 0; got = socket.read()) frames += got;
    }
    return frames;
  }

 private:
  std::array<BareSocket, 3> sockets_;
  std::vector<can_frame> sync_{raw(0x080, {})};
  std::array<std::vector<can_frame>, 2> targets_{
      {{raw(0x201, {0x0F, 0, 1, 0, 0, 0}), raw(0x202, {0x0F, 0, 1, 0, 0, 0}), raw(0x203, {0x0F, 0, 1, 0, 0, 0})},
       {raw(0x204, {0x0F, 0, 1, 0, 0, 0}), raw(0x205, {0x0F, 0, 1, 0, 0, 0}), raw(0x206, {0x0F, 0, 1, 0, 0, 0})}}};
};

description::DriveDescription drive_of(std::uint8_t node) {
  description::DriveDescription drive;
  drive.joint = "axis";
  drive.node = node;
  drive.counts_per_motor_revolution = 2000.0 * std::numbers::pi;
  drive.gear_ratio = 1.0;
  drive.range_rad = {-3.0, 3.0};
  drive.max_acceleration_rad_per_s2 = 20.0;
  return drive;
}

// As the cycle does it: SYNC; wait and receive until all is there; bytes to angles and forces; targets to bytes.
class FieldbusLoop {
 public:
  explicit FieldbusLoop(const std::array<std::string, 3>& interfaces)
      : network_({interfaces[0], interfaces[1], interfaces[2]}),
        sensor_(description::load_sensor(source_file("models/sensors/aidin_aft200.yaml")), {.bus_name = "sensor"}) {
    for (std::uint8_t node = 1; node <= 6; ++node) drives_.emplace_back(drive_of(node), DriveSettings{});
    for (ServoDrive& drive : drives_) drive.request(DriveGoal::operation_enabled);
    for (std::size_t bus = 0; bus < 3; ++bus) {
      std::vector<CanFilter> filters;
      for (const can_frame& frame : incoming[bus]) filters.push_back({.id = frame.can_id, .mask = 0x7ff});
      network_.set_filters(bus, filters);
    }
  }
  void begin() {
    CanFrame sync;
    sync.id = 0x080;
    for (std::size_t bus = 0; bus < 2; ++bus) network_.bus(bus).send(sync);
    for (ServoDrive& drive : drives_) drive.on_sync(++time_ns_);
    CanFrame none;
    sensor_.poll(time_ns_, none);
  }
  int end() {
    int frames = 0;
    TimedFrame received;
    while (!all_fresh() && network_.wait_for_frame(INT64_MAX / 2)) {
      for (std::size_t bus = 0; bus < 3; ++bus) {
        while (network_.bus(bus).receive(received)) {
          ++frames;
          if (bus == 2) {
            sensor_.on_frame(received.frame, received.time_ns);
            continue;
          }
          for (std::size_t i = 3 * bus; i < 3 * bus + 3; ++i) {
            if (drives_[i].on_frame(received.frame, received.time_ns)) break;
          }
        }
      }
    }
    force_N_ += sensor_.latest().wrench_S[0];
    for (std::size_t bus = 0; bus < 2; ++bus) {
      for (std::size_t i = 0; i < 3; ++i) {
        ServoDrive& drive = drives_[3 * bus + i];
        drive.set_target_rad(drive.actual_rad() + 1e-3);
        drive.encode_rpdo(targets_[i]);
      }
      network_.bus(bus).send_all(targets_, 0, results_.data());
    }
    return frames;
  }
  int drain() {
    int frames = 0;
    TimedFrame received;
    for (std::size_t bus = 0; bus < 3; ++bus) {
      while (network_.bus(bus).receive(received) || network_.bus(bus).receive(received)) ++frames;
    }
    return frames;
  }
  [[nodiscard]] bool following() const {
    return std::all_of(drives_.begin(), drives_.end(), [](const ServoDrive& d) { return d.following(); });
  }

 private:
  [[nodiscard]] bool all_fresh() const {
    return sensor_.fresh() &&
           std::all_of(drives_.begin(), drives_.end(), [](const ServoDrive& d) { return d.fresh(); });
  }

  SocketCanNetwork network_;
  DescribedSensor sensor_;
  std::vector<ServoDrive> drives_;
  std::array<CanFrame, 3> targets_{};
  std::array<SendResult, 3> results_{};
  std::int64_t time_ns_ = 0;
  double force_N_ = 0.0;
};

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Seconds of one batch of cycles.
template <class Loop>
double batch(Loop& loop, Peer& peer, int& frames) {
  const double begun = seconds();
  for (int i = 0; i < cycles_per_batch; ++i) {
    loop.begin();
    peer.feed();
    frames += loop.end();
  }
  return seconds() - begun;
}

// The peer alone: what it feeds waits in the loop's sockets and is read when the clock has stopped.
template <class Loop>
double peer_batch(Loop& loop, Peer& peer) {
  const double begun = seconds();
  for (int i = 0; i < cycles_per_batch; ++i) peer.feed();
  const double taken = seconds() - begun;
  EXPECT_EQ(loop.drain(), cycles_per_batch * 8);
  return taken;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

TEST(VcanTiming, OfBytesInToBytesOutIsOneAndAHalfTimesTheBareSystemCallsAtMost) {
  const char* clock = std::getenv("VCAN_CLOCK");
  if (clock == nullptr || std::strcmp(clock, "real") != 0 || ::if_nametoindex("vcan5") == 0) {
    GTEST_SKIP() << "needs a real clock and six interfaces: VCAN_TIME=real VCAN_N=6 tests/vcan/with-vcan";
  }
  const std::array<std::string, 3> ours{"vcan0", "vcan1", "vcan2"}, bares{"vcan3", "vcan4", "vcan5"};
  Peer our_peer(ours), bare_peer(bares);
  FieldbusLoop loop(ours);
  BareLoop bare(bares);
  ASSERT_TRUE(bare.ok());
  std::array<std::vector<double>, 4> times_s;  // of each batch: ours, bare, and the peers alone
  for (auto& of_kind : times_s) of_kind.reserve(batches);
  int our_frames = 0, bare_frames = 0;
  std::uint64_t allocations = 0;
  batch(loop, our_peer, our_frames);  // pages, caches, and the drives' way to operation enabled
  batch(bare, bare_peer, bare_frames);
  our_frames = bare_frames = 0;
  for (int i = 0; i < batches; ++i) {
    const std::uint64_t before = tests::allocation_count();
    times_s[0].push_back(batch(loop, our_peer, our_frames));
    allocations += tests::allocation_count() - before;
    times_s[1].push_back(batch(bare, bare_peer, bare_frames));
    times_s[2].push_back(peer_batch(loop, our_peer));
    times_s[3].push_back(peer_batch(bare, bare_peer));
  }
  constexpr int cycles = batches * cycles_per_batch;
  EXPECT_TRUE(loop.following()) << "a drive takes no targets";
  EXPECT_EQ(our_frames, cycles * 8);
  EXPECT_EQ(bare_frames, cycles * 8);
  EXPECT_EQ(allocations, 0u);
  // Medians of the batches: what stops the machine for milliseconds falls on some of them, and on either loop.
  const auto us = [&](std::size_t kind) { return 1e6 * median(times_s[kind]) / cycles_per_batch; };
  const double ours_us = us(0) - us(2), bare_us = us(1) - us(3);
  std::printf(
      "%d cycles each: %.2f us with the fieldbus, %.2f us bare: %.2f times (with the peer's own %.2f us: %.2f)\n",
      cycles, ours_us, bare_us, ours_us / bare_us, us(2), us(0) / us(1));
  EXPECT_LE(ours_us / bare_us, 1.5);
}

}  // namespace
}  // namespace proxarm::fieldbus
