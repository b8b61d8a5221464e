// How long a CAN frame occupies its bus: the exact time from its bits, and published bounds for planning.
//
// Classic frame, n data bytes (ISO 11898-1; one column per bit count):
//   11-bit: SOF 1, id 11, RTR 1, IDE 1, r0 1, DLC 4, data 8n, CRC 15                                       = 34 + 8n
//   29-bit: SOF 1, id 11, SRR 1, IDE 1, id 18, RTR 1, r1 1, r0 1, DLC 4, data 8n, CRC 15                   = 54 + 8n
//     these are stuffed: after five equal bits, stuff bits counted, follows one of the other value
//   CRC delimiter 1, ACK 1, ACK delimiter 1, EOF 7, interframe space 3                                      = 13
// CAN FD:
//   11-bit: SOF 1, id 11, RRS 1, IDE 1, FDF 1, res 1, BRS 1                                                = 17
//   29-bit: SOF 1, id 11, SRR 1, IDE 1, id 18, RRS 1, FDF 1, res 1, BRS 1                                  = 36
//   ESI 1, DLC 4, data 8n (stuffed as above up to here)
//   stuff count 4, CRC 17 (n ≤ 16) or 21, with a fixed stuff bit before the stuff count and after each four of these
//   bits: 27 or 32 in all; then the same 13 bits as above
//   A dynamic stuff bit due after the last data bit coincides with the first fixed one. ESI is assumed 0 (sender error
//   active). With BRS, all but the first line and the last 13 bits are sent at the data bitrate.
#pragma once

#include <cstdint>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

inline constexpr int can_interframe_bits = 3;

struct BitRates {
  std::int64_t nominal = 1'000'000;  // bit/s, > 0; arbitration phase
  std::int64_t data = 0;             // bit/s of the CAN FD data phase; 0: all at the nominal rate
};

// Bits on the wire, interframe space included, by bitrate.
struct WireBits {
  int nominal = 0;
  int data = 0;  // 0 unless FD with bit rate switch

  [[nodiscard]] constexpr int total() const noexcept { return nominal + data; }
  friend constexpr bool operator==(const WireBits&, const WireBits&) = default;
};

// Exact bits of this frame. Invalid lengths are rounded up to the next valid one. No allocation; any thread.
[[nodiscard]] WireBits wire_bits(const CanFrame& frame) noexcept;

// Duration in ns, rounded to the nearest.
[[nodiscard]] constexpr std::int64_t wire_time_ns(WireBits bits, const BitRates& rates) noexcept {
  const std::int64_t data_rate = rates.data > 0 ? rates.data : rates.nominal;
  const std::int64_t nominal_ns = (bits.nominal * std::int64_t{1'000'000'000} + rates.nominal / 2) / rates.nominal;
  if (bits.data == 0) return nominal_ns;
  return nominal_ns + (bits.data * std::int64_t{1'000'000'000} + data_rate / 2) / data_rate;
}
[[nodiscard]] inline std::int64_t wire_time_ns(const CanFrame& frame, const BitRates& rates) noexcept {
  return wire_time_ns(wire_bits(frame), rates);
}

// Properties of a frame that are known in planning.
struct FrameShape {
  int bytes = 0;
  bool extended = false;
  bool fd = false;
  bool bit_rate_switch = false;
  friend constexpr bool operator==(const FrameShape&, const FrameShape&) = default;
};

// Next length with a DLC: up to 8 itself (classic: at most 8), then 12, 16, 20, 24, 32, 48, 64.
[[nodiscard]] constexpr int padded_length(int bytes, bool fd) noexcept {
  if (bytes <= 0) return 0;
  if (bytes <= 8) return bytes;
  if (!fd) return 8;
  for (const int length : {12, 16, 20, 24, 32, 48}) {
    if (bytes <= length) return length;
  }
  return 64;
}
// True if a frame of this kind can carry this many bytes.
[[nodiscard]] constexpr bool is_valid_length(int bytes, bool fd) noexcept {
  return bytes >= 0 && padded_length(bytes, fd) == bytes;
}
// The DLC of a padded length.
[[nodiscard]] constexpr int data_length_code(int bytes) noexcept {
  if (bytes <= 8) return bytes;
  return bytes <= 24 ? 9 + (bytes - 12) / 4 : bytes == 32 ? 13 : bytes == 48 ? 14 : 15;
}

namespace can_timing_detail {
constexpr WireBits bits_with_stuffing(const FrameShape& shape, bool worst) noexcept {
  const int n = padded_length(shape.bytes, shape.fd);
  // A stuff bit after the first five bits, then, as it counts itself, after every four.
  const auto stuffing = [worst](int bits) { return worst ? (bits - 1) / 4 : 0; };
  if (!shape.fd) {
    const int stuffed = (shape.extended ? 54 : 34) + 8 * n;
    return {stuffed + stuffing(stuffed) + 13, 0};
  }
  const int head = shape.extended ? 36 : 17;
  const int rest = 5 + 8 * n;
  const WireBits bits{head + stuffing(head) + 13, rest + stuffing(head + rest) - stuffing(head) + (n <= 16 ? 27 : 32)};
  return shape.bit_rate_switch ? bits : WireBits{bits.total(), 0};
}
}  // namespace can_timing_detail

// Without a single (dynamic) stuff bit: 47 + 8n classic.
[[nodiscard]] constexpr WireBits minimum_wire_bits(const FrameShape& shape) noexcept {
  return can_timing_detail::bits_with_stuffing(shape, false);
}
// The published upper bound: classic 55 + 10n (11 bits), 80 + 10n (29 bits). No frame is longer.
[[nodiscard]] constexpr WireBits worst_wire_bits(const FrameShape& shape) noexcept {
  return can_timing_detail::bits_with_stuffing(shape, true);
}

}  // namespace proxarm::fieldbus
