// Reads and writes numbers in the bytes of a frame, independent of the machine's byte order. The suffix _le means
// little-endian, _be big-endian.
//
// Precondition: `bytes` points to at least as many bytes as the number has.
#pragma once

#include <bit>
#include <cstdint>

namespace proxarm::fieldbus {

[[nodiscard]] constexpr std::uint16_t read_u16_le(const std::uint8_t* bytes) noexcept {
  return static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
}

[[nodiscard]] constexpr std::uint32_t read_u32_le(const std::uint8_t* bytes) noexcept {
  return static_cast<std::uint32_t>(read_u16_le(bytes)) | static_cast<std::uint32_t>(read_u16_le(bytes + 2)) << 16;
}

[[nodiscard]] constexpr std::int32_t read_i32_le(const std::uint8_t* bytes) noexcept {
  return std::bit_cast<std::int32_t>(read_u32_le(bytes));
}

[[nodiscard]] constexpr std::uint16_t read_u16_be(const std::uint8_t* bytes) noexcept {
  return static_cast<std::uint16_t>(bytes[0] << 8 | bytes[1]);
}

[[nodiscard]] constexpr std::int16_t read_i16_be(const std::uint8_t* bytes) noexcept {
  return std::bit_cast<std::int16_t>(read_u16_be(bytes));
}

[[nodiscard]] constexpr std::uint32_t read_u32_be(const std::uint8_t* bytes) noexcept {
  return static_cast<std::uint32_t>(read_u16_be(bytes)) << 16 | static_cast<std::uint32_t>(read_u16_be(bytes + 2));
}

[[nodiscard]] constexpr float read_float_be(const std::uint8_t* bytes) noexcept {
  return std::bit_cast<float>(read_u32_be(bytes));
}

constexpr void write_u16_le(std::uint8_t* bytes, std::uint16_t value) noexcept {
  bytes[0] = static_cast<std::uint8_t>(value);
  bytes[1] = static_cast<std::uint8_t>(value >> 8);
}

constexpr void write_u32_le(std::uint8_t* bytes, std::uint32_t value) noexcept {
  write_u16_le(bytes, static_cast<std::uint16_t>(value));
  write_u16_le(bytes + 2, static_cast<std::uint16_t>(value >> 16));
}

}  // namespace proxarm::fieldbus
