// A CAN frame: classic or FD, 11- or 29-bit identifier.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace proxarm::fieldbus {

// One CAN or CAN FD data frame. `length` counts its data bytes. Valid lengths: 0..8 (classic); 0..8, 12, 16, 20, 24,
// 32, 48, 64 (CAN FD). All data bytes from index `length` on are zero and aren't sent.
struct CanFrame {
  std::uint32_t id = 0;   // 11 or 29 bits, without flag bits
  bool extended = false;  // true: `id` has 29 bits, false: 11 bits
  bool remote = false;    // remote request (classic only), without data
  bool error = false;     // bus error reported by SocketCAN (error frame); no such frame was on the wire
  bool fd = false;
  bool bit_rate_switch = false;  // CAN FD: the data phase uses the higher bitrate
  std::uint8_t length = 0;
  std::array<std::uint8_t, 64> data{};

  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return {data.data(), length}; }
  friend bool operator==(const CanFrame&, const CanFrame&) = default;
};

// A frame and the time at which its last bit was on the wire, in ns of the network's clock.
struct TimedFrame {
  CanFrame frame;
  std::int64_t time_ns = 0;
};

}  // namespace proxarm::fieldbus
