// CAN on Linux: CAN interfaces (can0, vcan0) through SocketCAN raw sockets, on CLOCK_MONOTONIC.
//
//   SocketCanNetwork network({"vcan0", "vcan0", "vcan1"});   // a name given twice is one logical bus
//   network.bus_of(1) == 0, network.bus_of(2) == 1
//   network.set_filters(0, {{.id = 0x180, .mask = 0x780}, {.id = 0x080, .mask = 0x7ff}});
//
// Each bus has one non-blocking socket. Frames are sent and received in batches (sendmmsg, recvmmsg). The kernel drops
// frames that no filter accepts. It also drops frames for which its buffer has no room, and counts those (SO_RXQ_OVFL).
// receive() never returns error frames; error frames change status().state.
//
// A frame's time stamp is set by the kernel at reception (SO_TIMESTAMPNS, CLOCK_REALTIME). It is converted to
// CLOCK_MONOTONIC by the difference between the two clocks, which is measured again every 10 ms. The converted stamp is
// exact to 5 µs, even while CLOCK_REALTIME is slewed at its maximum rate, unless CLOCK_REALTIME was set since the last
// measurement. A stamp is never later than now and never earlier than the stamp of the previous frame.
//
// At bus-off the kernel purges its send queue. After bus-off, send() returns SendResult::bus_off until the interface
// reports its restart. The supervisor then decides which frames are sent. The state of a removed interface stays
// `down`. An interface that was set down works again once it is up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fieldbus/can/can_network.hpp"
#include "fieldbus/can/can_system.hpp"

namespace proxarm::fieldbus {

// Accepts frames with (id & mask) == (filter.id & mask) and the same identifier length, remote frames included.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0x1fffffff;
  bool extended = false;
};

struct SocketCanOptions {
  // Size of the kernel's receive buffer. The kernel's default of 208 kB holds only 278 frames. Without root rights,
  // net.core.rmem_max limits the size.
  int receive_buffer_bytes = 4 << 20;
  bool closed = false;  // no frame passes until set_filters() is called, so earlier frames can't fill the buffer
};

class SocketCanNetwork final : public CanNetwork {
 public:
  // Opens all interfaces; without any, the network has no bus but keeps the time. Throws SetupError if the kernel has
  // no CAN, or if an interface doesn't exist, is no CAN interface or is down. The message says what to do. `system`
  // must outlive the network.
  explicit SocketCanNetwork(const std::vector<std::string>& interfaces, const SocketCanOptions& options = {},
                            CanSystem& system = CanSystem::real());
  ~SocketCanNetwork() override;

  // Returns the index of the bus to which the i-th name of the list belongs.
  [[nodiscard]] std::size_t bus_of(std::size_t listed) const noexcept { return bus_of_[listed]; }
  // Lets only frames pass that match at least one of these filters; an empty list lets no frame pass. Frames that were
  // received before the call stay in the queue. Until the first call every frame passes, or no frame if
  // SocketCanOptions::closed is set. Throws SetupError if the kernel refuses the filters, as it does for more than 512.
  void set_filters(std::size_t bus, const std::vector<CanFilter>& filters);
  [[nodiscard]] bool carries_fd(std::size_t bus) const noexcept;

  [[nodiscard]] std::size_t bus_count() const noexcept override { return buses_.size(); }
  [[nodiscard]] CanBus& bus(std::size_t index) noexcept override;
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return system_.clock_ns(CLOCK_MONOTONIC); }
  void sleep_until(std::int64_t deadline_ns) noexcept override { system_.sleep_until(deadline_ns); }
  bool wait_for_frame(std::int64_t deadline_ns) noexcept override;
  [[nodiscard]] std::int64_t waited_ns() const noexcept override { return waited_ns_; }

 private:
  class Bus;
  class Clocks;

  CanSystem& system_;
  std::unique_ptr<Clocks> clocks_;
  std::vector<std::unique_ptr<Bus>> buses_;
  std::vector<std::size_t> bus_of_;
  std::vector<pollfd> poll_;
  std::vector<bool> filled_;  // per bus: whether the last wait read frames from it
  std::int64_t waited_ns_ = 0;
};

// True if rtnetlink (IFLA_INFO_KIND) reports the interface's kind as vcan or vxcan. The interface's name doesn't
// matter. sysfs isn't used because it calls slcan virtual too, and slcan is a real bus on a serial line. False if the
// interface doesn't exist. A gateway (cangw) that forwards a virtual bus to a real bus isn't detected.
[[nodiscard]] bool is_virtual_can(const std::string& interface, CanSystem& system = CanSystem::real());

}  // namespace proxarm::fieldbus
