// Heartbeat (CiA 301, 7.2.8.3.2.2): master and drives notice when the other stops.
//
// Wire: identifier 700 + node, one byte: the NMT state; 0 is the boot-up message, sent once after a reset.
// HeartbeatProducer sends the master's heartbeat, without which drives stop by themselves (1016h). One
// HeartbeatConsumer per drive watches the drive's heartbeat (1017h).
#pragma once

#include <cstdint>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/canopen/canopen_nmt.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::fieldbus {

inline constexpr std::uint32_t heartbeat_id(std::uint8_t node) noexcept { return 0x700U + node; }

// Sends a heartbeat only if the cycle's counter has moved. It is called from the cycle: a heartbeat from another thread
// would go on after the cycle has stopped.
class HeartbeatProducer {
 public:
  HeartbeatProducer(std::uint8_t node, std::int64_t period_ns) noexcept : node_(node), period_ns_(period_ns) {}

  // True if a heartbeat is due and was written to `frame`. `cycle` counts completed cycles.
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
  // `timeout_ns` 0: follows the state, but never reports a loss.
  HeartbeatConsumer(std::uint8_t node, std::int64_t timeout_ns) noexcept : node_(node), timeout_ns_(timeout_ns) {}

  // True if the frame was this node's heartbeat or boot-up message.
  bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept;
  [[nodiscard]] NmtState state() const noexcept { return state_; }
  [[nodiscard]] std::uint64_t boot_ups() const noexcept { return boot_ups_; }
  [[nodiscard]] bool heard() const noexcept { return heard_; }
  // Watching starts with the first heartbeat, as in the standard, or with restart().
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
