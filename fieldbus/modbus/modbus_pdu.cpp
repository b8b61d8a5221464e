#include "fieldbus/modbus/modbus_pdu.hpp"

#include <algorithm>

namespace proxarm::fieldbus {
namespace {

void put(ModbusMessage& message, unsigned byte) noexcept {
  message.bytes[message.size++] = static_cast<std::uint8_t>(byte);
}

void put16(ModbusMessage& message, unsigned value) noexcept {
  put(message, value >> 8 & 0xFF);
  put(message, value & 0xFF);
}

ModbusMessage begin(std::uint8_t unit, ModbusFunction function) noexcept {
  ModbusMessage message;
  put(message, unit);
  put(message, static_cast<unsigned>(function));
  return message;
}

void put_values(ModbusMessage& message, std::uint16_t at, std::span<const std::uint16_t> values) noexcept {
  values = values.first(std::min(values.size(), modbus_most_written));
  put16(message, at);
  put16(message, static_cast<unsigned>(values.size()));
  put(message, static_cast<unsigned>(2 * values.size()));
  for (const std::uint16_t value : values) put16(message, value);
}

}  // namespace

ModbusMessage encode_read(std::uint8_t unit, std::uint16_t at, std::size_t count) noexcept {
  ModbusMessage message = begin(unit, ModbusFunction::read_registers);
  put16(message, at);
  put16(message, static_cast<unsigned>(count));
  return message;
}

ModbusMessage encode_write(std::uint8_t unit, std::uint16_t at, std::span<const std::uint16_t> values) noexcept {
  ModbusMessage message = begin(unit, ModbusFunction::write_registers);
  put_values(message, at, values);
  return message;
}

ModbusMessage encode_read_write(std::uint8_t unit, std::uint16_t read_at, std::size_t read_count, std::uint16_t at,
                                std::span<const std::uint16_t> values) noexcept {
  ModbusMessage message = begin(unit, ModbusFunction::read_write_registers);
  put16(message, read_at);
  put16(message, static_cast<unsigned>(read_count));
  put_values(message, at, values);
  return message;
}

ModbusResult decode_answer(std::span<const std::uint8_t> request, std::span<const std::uint8_t> answer,
                           std::span<std::uint16_t> values, int& exception) noexcept {
  exception = 0;
  if (request.size() < 6 || answer.size() < 3) return ModbusResult::malformed;
  if (answer[0] != request[0]) return ModbusResult::wrong_unit;
  const std::uint8_t function = request[1];
  if (answer[1] == (function | 0x80U)) {
    if (answer.size() != 3) return ModbusResult::malformed;
    exception = answer[2];
    return ModbusResult::exception;
  }
  if (answer[1] != function) return ModbusResult::malformed;
  if (function == static_cast<std::uint8_t>(ModbusFunction::write_registers)) {
    // The answer to a write repeats the request's address and count.
    return answer.size() == 6 && std::equal(answer.begin(), answer.end(), request.begin()) ? ModbusResult::ok
                                                                                           : ModbusResult::malformed;
  }
  if (answer[2] != 2 * values.size() || answer.size() != 3 + 2 * values.size()) return ModbusResult::malformed;
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<std::uint16_t>(answer[3 + 2 * i] << 8 | answer[4 + 2 * i]);
  }
  return ModbusResult::ok;
}

const char* modbus_exception_name(int code) noexcept {
  switch (code) {
    case 1:
      return "illegal function";
    case 2:
      return "illegal data address";
    case 3:
      return "illegal data value";
    case 4:
      return "server device failure";
    case 5:
      return "acknowledge";
    case 6:
      return "server device busy";
    case 8:
      return "memory parity error";
    case 10:
      return "gateway path unavailable";
    case 11:
      return "gateway target device failed to respond";
    default:
      return "unknown exception";
  }
}

}  // namespace proxarm::fieldbus
