// Encodes and decodes Modbus requests and answers as bytes, from the unit to the end of the PDU. The TCP header (MBAP)
// and the RTU checksum (CRC) aren't included. Source: MODBUS Application Protocol Specification V1.1b3, sections 6.3,
// 6.12 and 6.17. Numbers are big-endian. In the table, a number in parentheses counts bytes:
//
//   03 read holding registers            unit 03 at(2) count(2)
//        answer                          unit 03 bytes(1) values
//   16 write multiple registers          unit 10 at(2) count(2) bytes(1) values
//        answer                          unit 10 at(2) count(2)
//   23 read/write multiple registers     unit 17 read_at(2) read_count(2) at(2) count(2) bytes(1) values
//        answer                          unit 17 bytes(1) values
//   exception                            unit function|80 code
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace proxarm::fieldbus {

enum class ModbusResult : std::uint8_t { ok, timeout, closed, exception, wrong_unit, malformed };

enum class ModbusFunction : std::uint8_t { read_registers = 3, write_registers = 16, read_write_registers = 23 };

inline constexpr std::size_t modbus_most_bytes = 254;  // one byte for the unit, and a PDU of at most 253 bytes
inline constexpr std::size_t modbus_most_read = 125, modbus_most_written = 121;

struct ModbusMessage {
  std::array<std::uint8_t, modbus_most_bytes> bytes{};
  std::size_t size = 0;

  [[nodiscard]] std::span<const std::uint8_t> span() const noexcept { return {bytes.data(), size}; }
};

// Encode requests. Preconditions: 1 to modbus_most_read registers are read, 1 to modbus_most_written registers are
// written.
[[nodiscard]] ModbusMessage encode_read(std::uint8_t unit, std::uint16_t at, std::size_t count) noexcept;
[[nodiscard]] ModbusMessage encode_write(std::uint8_t unit, std::uint16_t at,
                                         std::span<const std::uint16_t> values) noexcept;
[[nodiscard]] ModbusMessage encode_read_write(std::uint8_t unit, std::uint16_t read_at, std::size_t read_count,
                                              std::uint16_t at, std::span<const std::uint16_t> values) noexcept;

// Decodes an answer. The answer to function 3 or 23 must fill `values` exactly. `values` changes only if the result is
// ok. If the result is exception, `exception` is set to the exception code (0 to 255).
[[nodiscard]] ModbusResult decode_answer(std::span<const std::uint8_t> request, std::span<const std::uint8_t> answer,
                                         std::span<std::uint16_t> values, int& exception) noexcept;

// Exception code "server device busy". The specification asks the client to send the request again later.
inline constexpr int modbus_busy = 6;

// Returns the exception's name in the specification, such as "illegal data address"; "unknown" for a code that the
// specification doesn't define.
[[nodiscard]] const char* modbus_exception_name(int code) noexcept;

}  // namespace proxarm::fieldbus
