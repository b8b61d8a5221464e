// Modbus requests and answers as bytes, from the unit to the last of the PDU, without what TCP (MBAP header) or RTU
// (CRC) put around it. MODBUS Application Protocol Specification V1.1b3, sections 6.3, 6.12 and 6.17; numbers
// big-endian.
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

inline constexpr std::size_t modbus_most_bytes = 254;  // unit and PDU of 253
inline constexpr std::size_t modbus_most_read = 125, modbus_most_written = 121;

struct ModbusMessage {
  std::array<std::uint8_t, modbus_most_bytes> bytes{};
  std::size_t size = 0;

  [[nodiscard]] std::span<const std::uint8_t> span() const noexcept { return {bytes.data(), size}; }
};

// At most modbus_most_read registers read, modbus_most_written written; at least one.
[[nodiscard]] ModbusMessage encode_read(std::uint8_t unit, std::uint16_t at, std::size_t count) noexcept;
[[nodiscard]] ModbusMessage encode_write(std::uint8_t unit, std::uint16_t at,
                                         std::span<const std::uint16_t> values) noexcept;
[[nodiscard]] ModbusMessage encode_read_write(std::uint8_t unit, std::uint16_t read_at, std::size_t read_count,
                                              std::uint16_t at, std::span<const std::uint16_t> values) noexcept;

// What an answer says. `values` must be filled exactly by functions 3 and 23; nothing is changed unless the result is
// ok. `exception`: the code, where the result is exception (a byte, so 0 to 255).
[[nodiscard]] ModbusResult decode_answer(std::span<const std::uint8_t> request, std::span<const std::uint8_t> answer,
                                         std::span<std::uint16_t> values, int& exception) noexcept;

// Server device busy: the specification asks to send the request again later.
inline constexpr int modbus_busy = 6;

// "illegal data address", the specification's wording; "unknown" for codes that it doesn't have.
[[nodiscard]] const char* modbus_exception_name(int code) noexcept;

}  // namespace proxarm::fieldbus
