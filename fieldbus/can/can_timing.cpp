#include "fieldbus/can/can_timing.hpp"

#include <array>

namespace proxarm::fieldbus {
namespace {

// Bit stuffing as a machine of eight states. Bit 2 of the state is the value of the last bit on the wire. Bits 0 and 1
// are the number of equal bits at the end of the wire, minus one. The transition that adds the fifth equal bit also
// adds its stuff bit.
struct StuffStep {
  int state;
  int stuff_bits;
};
constexpr StuffStep stuff_one_bit(int state, int bit) {
  const int value = state >> 2, run = (state & 3) + 1;
  if (bit != value) return {bit << 2, 0};
  if (run < 4) return {(bit << 2) | run, 0};
  return {(1 - bit) << 2, 1};  // this was the fifth equal bit; its stuff bit begins the next run
}

// Entry for [state][byte]: the next state in bits 0..2, the number of stuff bits in this byte in bits 3 and 4.
using StuffTable = std::array<std::array<std::uint8_t, 256>, 8>;
constexpr StuffTable make_stuff_table() {
  StuffTable table{};
  for (int start = 0; start < 8; ++start) {
    for (int byte = 0; byte < 256; ++byte) {
      int state = start, count = 0;
      for (int i = 7; i >= 0; --i) {
        const StuffStep step = stuff_one_bit(state, (byte >> i) & 1);
        state = step.state;
        count += step.stuff_bits;
      }
      table[start][byte] = static_cast<std::uint8_t>(state | (count << 3));
    }
  }
  return table;
}
constexpr StuffTable stuff_table = make_stuff_table();

// CRC-15 of classic CAN: x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, initial value 0.
constexpr std::array<std::uint16_t, 256> make_crc15_table() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned crc = byte << 7;
    for (int i = 0; i < 8; ++i) crc = (crc & 0x4000) != 0 ? (crc << 1) ^ 0x4599 : crc << 1;
    table[byte] = static_cast<std::uint16_t>(crc & 0x7fff);
  }
  return table;
}
constexpr std::array<std::uint16_t, 256> crc15_table = make_crc15_table();

class StuffCounter {
 public:
  void byte(unsigned value) noexcept {
    const unsigned entry = stuff_table[state_][value];
    state_ = entry & 7;
    count_ += static_cast<int>(entry >> 3);
  }
  void bit(int value) noexcept {
    const StuffStep step = stuff_one_bit(static_cast<int>(state_), value);
    state_ = static_cast<unsigned>(step.state);
    count_ += step.stuff_bits;
  }
  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] int last_bit_on_wire() const noexcept { return static_cast<int>(state_ >> 2); }

 private:
  unsigned state_ = 0;
  int count_ = 0;
};

WireBits classic_bits(const CanFrame& frame) noexcept {
  const int length = padded_length(frame.length, false);
  const int bytes = frame.remote ? 0 : length;
  const std::uint64_t remote = frame.remote ? 1 : 0;
  const auto dlc = static_cast<std::uint64_t>(length);
  // The bits from SOF (0) to DLC, right-aligned. Zeros before the SOF don't change the CRC.
  std::uint64_t header = 0;
  int header_bytes = 3;
  // Bits before the SOF that complete its byte. They alternate, so they cause no stuff bit.
  std::uint64_t padding = 0b10101ull << 19;
  if (frame.extended) {
    const std::uint64_t base = (frame.id >> 18) & 0x7ff, extension = frame.id & 0x3ffff;
    header = (base << 27) | (3ull << 25) | (extension << 7) | (remote << 6) | dlc;
    header_bytes = 5;
    padding = 1ull << 39;
  } else {
    header = ((frame.id & 0x7ffull) << 7) | (remote << 6) | dlc;
  }
  StuffCounter stuff;
  unsigned crc = 0;
  for (int i = header_bytes - 1; i >= 0; --i) {
    const auto byte = static_cast<unsigned>(header >> (8 * i)) & 0xff;
    crc = ((crc << 8) ^ crc15_table[((crc >> 7) ^ byte) & 0xff]) & 0x7fff;
    stuff.byte(static_cast<unsigned>((header | padding) >> (8 * i)) & 0xff);
  }
  for (int i = 0; i < bytes; ++i) {
    const unsigned byte = frame.data[static_cast<std::size_t>(i)];
    crc = ((crc << 8) ^ crc15_table[((crc >> 7) ^ byte) & 0xff]) & 0x7fff;
    stuff.byte(byte);
  }
  // The 15 CRC bits and one padding bit. The padding bit differs from the last CRC bit, so it completes no run of five.
  const unsigned tail = (crc << 1) | (~crc & 1);
  stuff.byte(tail >> 8);
  stuff.byte(tail & 0xff);
  return {(frame.extended ? 54 : 34) + 8 * bytes + stuff.count() + 13, 0};
}

WireBits fd_bits(const CanFrame& frame) noexcept {
  const int bytes = padded_length(frame.length, true);
  const std::uint64_t switched = frame.bit_rate_switch ? 1 : 0;
  // The bits from SOF (0) to BRS, right-aligned, after alternating padding bits.
  std::uint64_t header = 0;
  int header_bytes = 3;
  if (frame.extended) {
    const std::uint64_t base = (frame.id >> 18) & 0x7ff, extension = frame.id & 0x3ffff;
    // After the base identifier: SRR 1, IDE 1, extension, RRS 0, FDF 1, res 0, BRS.
    header = (0b0101ull << 36) | (base << 24) | (3ull << 22) | (extension << 4) | (1ull << 2) | switched;
    header_bytes = 5;
  } else {
    header = (0b1010101ull << 17) | ((frame.id & 0x7ffull) << 5) | (1ull << 2) | switched;
  }
  StuffCounter stuff;
  for (int i = header_bytes - 1; i >= 0; --i) stuff.byte(static_cast<unsigned>(header >> (8 * i)) & 0xff);
  const int head_stuff = stuff.count();

  const int dlc = data_length_code(bytes);
  stuff.bit(0);  // ESI
  for (int i = 3; i >= 0; --i) stuff.bit((dlc >> i) & 1);
  int last_bit = dlc & 1;
  if (bytes > 0) {
    for (int i = 0; i < bytes; ++i) stuff.byte(frame.data[static_cast<std::size_t>(i)]);
    last_bit = frame.data[static_cast<std::size_t>(bytes - 1)] & 1;
  }
  // A stuff bit due after the last data bit is the first fixed stuff bit. The 27 or 32 bits below already include it.
  const int rest_stuff = stuff.count() - head_stuff - (stuff.last_bit_on_wire() != last_bit ? 1 : 0);
  const WireBits bits{(frame.extended ? 36 : 17) + head_stuff + 13,
                      5 + 8 * bytes + rest_stuff + (bytes <= 16 ? 27 : 32)};
  return frame.bit_rate_switch ? bits : WireBits{bits.total(), 0};
}

}  // namespace

WireBits wire_bits(const CanFrame& frame) noexcept { return frame.fd ? fd_bits(frame) : classic_bits(frame); }

}  // namespace proxarm::fieldbus
