// CAN on Linux: CAN interfaces (can0, vcan0) through SocketCAN raw sockets, on CLOCK_MONOTONIC.
//
//   SocketCanNetwork network({"vcan0", "vcan0", "vcan1"});   // a name given twice is one logical bus
//   network.bus_of(1) == 0, network.bus_of(2) == 1
//   network.set_filters(0, {{.id = 0x180, .mask = 0x780}, {.id = 0x080, .mask = 0x7ff}});
//
// One non-blocking socket per bus. Frames are sent and received in batches (sendmmsg, recvmmsg). The kernel drops
// frames that no filter accepts, and counts those that its buffer had no room for (SO_RXQ_OVFL). receive() never
// returns error frames; they set status().state.
//
// A time stamp is the kernel's at reception (SO_TIMESTAMPNS, CLOCK_REALTIME), converted to CLOCK_MONOTONIC by the
// difference of both clocks, which is read again every 10 ms. That is exact to 5 µs, even while CLOCK_REALTIME is
// slewed at its maximum rate, unless that clock was set in between. A stamp is never later than now and never earlier
// than the previous frame's.
//
// After bus-off the kernel has purged its queue, and send() refuses until the interface reports its restart; the
// supervisor then decides what is sent. A removed interface stays `down`; one that was set down works again once it is
// up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fieldbus/can/can_network.hpp"
#include "fieldbus/can/can_system.hpp"

namespace proxarm::fieldbus {

// Frames with (id & mask) == (filter.id & mask) and this identifier length. Remote frames pass as well.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0x1fffffff;
  bool extended = false;
};

struct SocketCanOptions {
  int receive_buffer_bytes =
      4 << 20;          // the default of 208 kB holds 278 frames; limited by net.core.rmem_max unless root
  bool closed = false;  // nothing passes until set_filters(), so earlier frames can't fill the buffer
};

class SocketCanNetwork final : public CanNetwork {
 public:
  // Opens all interfaces. Throws SetupError with a message that says what to do if the kernel has no CAN, or if an
  // interface doesn't exist, is no CAN interface or is down. `system` must outlive the network.
  explicit SocketCanNetwork(const std::vector<std::string>& interfaces, const SocketCanOptions& options = {},
                            CanSystem& system = CanSystem::real());
  ~SocketCanNetwork() override;

  // Index of the bus for the i-th name of the list.
  [[nodiscard]] std::size_t bus_of(std::size_t listed) const noexcept { return bus_of_[listed]; }
  // From now on only frames that match one of these filters pass; none if the list is empty. Frames already received
  // stay. At first everything passes, unless SocketCanOptions::closed is set. At most 512 filters. Throws SetupError.
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
  std::vector<bool> filled_;  // by the last wait
  std::int64_t waited_ns_ = 0;
};

// True only for interfaces of kind vcan or vxcan by rtnetlink (IFLA_INFO_KIND), whatever their name. sysfs also calls
// slcan virtual, which is a real bus on a serial line. False if the interface doesn't exist. Doesn't detect a gateway
// (cangw) that forwards a virtual bus to a real one.
[[nodiscard]] bool is_virtual_can(const std::string& interface, CanSystem& system = CanSystem::real());

}  // namespace proxarm::fieldbus
