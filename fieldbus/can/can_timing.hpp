// Computes how long a CAN frame occupies its bus: the exact time from the frame's bits, and published bounds for
// planning.
//
// Classic frame with n data bytes (ISO 11898-1; each number is a count of bits):
//   11-bit: SOF 1, id 11, RTR 1, IDE 1, r0 1, DLC 4, data 8n, CRC 15                                       = 34 + 8n
//   29-bit: SOF 1, id 11, SRR 1, IDE 1, id 18, RTR 1, r1 1, r0 1, DLC 4, data 8n, CRC 15                   = 54 + 8n
//     these bits are stuffed: five equal bits in a row, stuff bits included, are followed by one bit of the opposite
//     value
//   not stuffed: CRC delimiter 1, ACK 1, ACK delimiter 1, EOF 7, interframe space 3                         = 13
// CAN FD:
//   11-bit: SOF 1, id 11, RRS 1, IDE 1, FDF 1, res 1, BRS 1                                                = 17
//   29-bit: SOF 1, id 11, SRR 1, IDE 1, id 18, RRS 1, FDF 1, res 1, BRS 1                                  = 36
//   ESI 1, DLC 4, data 8n                                                                                  = 5 + 8n
//   Dynamic stuff bits, as in a classic frame, are inserted from SOF to the last data bit.
//   The stuff count (4 bits) and the CRC (17 bits if n ≤ 16, else 21) follow. They have fixed stuff bits: one before
//   the stuff count and one after each four bits of stuff count and CRC. Together they are 27 or 32 bits.
//   The same 13 bits as in a classic frame end the frame.
//   A dynamic stuff bit that is due after the last data bit coincides with the first fixed stuff bit. ESI is assumed to
//   be 0 (the sender is error active). With BRS, ESI to CRC are sent at the data bitrate, all other bits at the nominal
//   bitrate.
#pragma once

#include <cstdint>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

inline constexpr int can_interframe_bits = 3;

struct BitRates {
  std::int64_t nominal = 1'000'000;  // bit/s of the arbitration phase, > 0
  std::int64_t data = 0;  // bit/s of the CAN FD data phase; 0: the nominal bitrate also holds for the data phase
};

// Number of bits on the wire at each bitrate, interframe space included.
struct WireBits {
  int nominal = 0;
  int data = 0;  // 0 except in a CAN FD frame with bit rate switch

  [[nodiscard]] constexpr int total() const noexcept { return nominal + data; }
  friend constexpr bool operator==(const WireBits&, const WireBits&) = default;
};

// Returns the exact bits of this frame. An invalid length counts as padded_length() says. Allocates nothing; may be
// called from any thread.
[[nodiscard]] WireBits wire_bits(const CanFrame& frame) noexcept;

// Returns the duration in ns. The time at each bitrate is rounded to the nearest ns.
[[nodiscard]] constexpr std::int64_t wire_time_ns(WireBits bits, const BitRates& rates) noexcept {
  const std::int64_t data_rate = rates.data > 0 ? rates.data : rates.nominal;
  const std::int64_t nominal_ns = (bits.nominal * std::int64_t{1'000'000'000} + rates.nominal / 2) / rates.nominal;
  if (bits.data == 0) return nominal_ns;
  return nominal_ns + (bits.data * std::int64_t{1'000'000'000} + data_rate / 2) / data_rate;
}
[[nodiscard]] inline std::int64_t wire_time_ns(const CanFrame& frame, const BitRates& rates) noexcept {
  return wire_time_ns(wire_bits(frame), rates);
}

// The properties of a frame that planning knows before the data bytes.
struct FrameShape {
  int bytes = 0;
  bool extended = false;
  bool fd = false;
  bool bit_rate_switch = false;
  friend constexpr bool operator==(const FrameShape&, const FrameShape&) = default;
};

// Returns the smallest valid frame length of at least `bytes`: 0..8, and for CAN FD also 12, 16, 20, 24, 32, 48, 64.
// Larger values give the maximum of 8 or 64.
[[nodiscard]] constexpr int padded_length(int bytes, bool fd) noexcept {
  if (bytes <= 0) return 0;
  if (bytes <= 8) return bytes;
  if (!fd) return 8;
  for (const int length : {12, 16, 20, 24, 32, 48}) {
    if (bytes <= length) return length;
  }
  return 64;
}
// True if a classic frame (or a CAN FD frame if `fd`) can have exactly this many data bytes.
[[nodiscard]] constexpr bool is_valid_length(int bytes, bool fd) noexcept {
  return bytes >= 0 && padded_length(bytes, fd) == bytes;
}
// Returns the DLC of a valid length.
[[nodiscard]] constexpr int data_length_code(int bytes) noexcept {
  if (bytes <= 8) return bytes;
  return bytes <= 24 ? 9 + (bytes - 12) / 4 : bytes == 32 ? 13 : bytes == 48 ? 14 : 15;
}

namespace can_timing_detail {
constexpr WireBits bits_with_stuffing(const FrameShape& shape, bool worst) noexcept {
  const int n = padded_length(shape.bytes, shape.fd);
  // The first stuff bit comes after five bits. Each stuff bit counts as the first of the next five, so every further
  // four bits add one.
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

// Returns the bits of a frame without dynamic stuff bits: 47 + 8n in a classic 11-bit frame.
[[nodiscard]] constexpr WireBits minimum_wire_bits(const FrameShape& shape) noexcept {
  return can_timing_detail::bits_with_stuffing(shape, false);
}
// Returns the published upper bound: 55 + 10n in a classic 11-bit frame, 80 + 10n in a classic 29-bit frame. No frame
// has more bits.
[[nodiscard]] constexpr WireBits worst_wire_bits(const FrameShape& shape) noexcept {
  return can_timing_detail::bits_with_stuffing(shape, true);
}

}  // namespace proxarm::fieldbus
