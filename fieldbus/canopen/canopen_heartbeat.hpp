// Heartbeat (CiA 301, 7.2.8.3.2.2): the master notices when a drive stops sending, and each drive when the master does.
//
// Wire: identifier 700 + node, one byte: the NMT state. State 0 is the boot-up message, which a node sends once after a
// reset.
// HeartbeatProducer sends the master's heartbeat; drives stop by themselves without it (1016h). One HeartbeatConsumer
// per drive watches the drive's heartbeat (1017h).
#pragma once

#include <cstdint>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/canopen/canopen_nmt.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::fieldbus {

inline constexpr std::uint32_t heartbeat_id(std::uint8_t node) noexcept { return 0x700U + node; }

// Produces the master's heartbeat. It must be called from the cycle, and a heartbeat is only due if the cycle counter
// has moved. A heartbeat from another thread would continue after the cycle has stopped, and the drives wouldn't stop.
class HeartbeatProducer {
 public:
  HeartbeatProducer(std::uint8_t node, std::int64_t period_ns) noexcept : node_(node), period_ns_(period_ns) {}

  // True if a heartbeat is due; it is then written to `frame`. `cycle` is the number of completed cycles.
  [[nodiscard]] bool due(std::int64_t now_ns, std::uint64_t cycle, CanFrame& frame) noexcept;
  void archive(StateArchive& state) noexcept { state(next_ns_, last_cycle_, ever_); }

 private:
  std::uint8_t node_;
  std::int64_t period_ns_;
  std::int64_t next_ns_ = 0;
  std::uint64_t last_cycle_ = 0;
  bool ever_ = false;
};

class HeartbeatConsumer {
 public:
  // If `timeout_ns` is 0, the consumer records the node's state, but never reports a loss.
  HeartbeatConsumer(std::uint8_t node, std::int64_t timeout_ns) noexcept : node_(node), timeout_ns_(timeout_ns) {}

  // Takes over the state from the frame. True if the frame was this node's heartbeat or boot-up message.
  bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept;
  [[nodiscard]] NmtState state() const noexcept { return state_; }
  [[nodiscard]] std::uint64_t boot_ups() const noexcept { return boot_ups_; }
  [[nodiscard]] bool heard() const noexcept { return heard_; }
  // True if the last heartbeat is older than the timeout. Never true before the first heartbeat (as in the standard) or
  // a call of restart().
  [[nodiscard]] bool lost(std::int64_t now_ns) const noexcept {
    return timeout_ns_ > 0 && heard_ && now_ns - last_ns_ > timeout_ns_;
  }
  void stop_watching() noexcept { timeout_ns_ = 0; }
  void restart(std::int64_t now_ns) noexcept {
    heard_ = true;
    last_ns_ = now_ns;
  }
  void archive(StateArchive& state) noexcept { state(timeout_ns_, last_ns_, boot_ups_, state_, heard_); }

 private:
  std::uint8_t node_;
  std::int64_t timeout_ns_;
  std::int64_t last_ns_ = 0;
  std::uint64_t boot_ups_ = 0;
  NmtState state_ = NmtState::unknown;
  bool heard_ = false;
};

}  // namespace proxarm::fieldbus
