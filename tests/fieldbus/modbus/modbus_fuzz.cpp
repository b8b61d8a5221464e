// Modbus answers from whoever is on the line: decoded without harm, and nothing taken from one that isn't ok.
//
// Input: one byte that chooses the request, then the answer.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "fieldbus/modbus/modbus_pdu.hpp"

using namespace proxarm::fieldbus;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::size_t count = 1 + data[0] % modbus_most_read;
  const std::array<std::uint16_t, 3> written{1, 2, 3};
  const ModbusMessage requests[] = {encode_read(1, 16, count), encode_write(1, 0, written),
                                    encode_read_write(1, 16, count, 0, written)};
  const std::span<const std::uint8_t> answer(data + 1, size - 1);
  for (const ModbusMessage& request : requests) {
    std::array<std::uint16_t, modbus_most_read> values{};
    values.fill(0xA5A5);
    int exception = 0;
    const bool reads = request.bytes[1] != static_cast<std::uint8_t>(ModbusFunction::write_registers);
    const std::span<std::uint16_t> wanted(values.data(), reads ? count : 0);
    const ModbusResult result = decode_answer(request.span(), answer, wanted, exception);
    const bool untouched = std::all_of(values.begin(), values.end(), [](std::uint16_t v) { return v == 0xA5A5; });
    if (result != ModbusResult::ok && !untouched) std::abort();
    if (result == ModbusResult::ok && (answer[0] != 1 || answer[1] != request.bytes[1])) std::abort();
    if ((result == ModbusResult::exception) !=
        (answer.size() == 3 && answer[0] == 1 && (answer[1] ^ request.bytes[1]) == 0x80)) {
      std::abort();
    }
    if (modbus_exception_name(exception) == nullptr) std::abort();
  }
  return 0;
}
