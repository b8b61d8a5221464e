#include "sim/devices/modbus_sensor_device.hpp"

#include "sim/devices/modbus_device.hpp"

namespace proxarm::sim {

void ModbusSensorDevice::send(const fieldbus::CanFrame& frame, std::int64_t) noexcept {
  const std::lock_guard lock(mutex_);
  bytes_ = frame.data;
}

void ModbusSensorDevice::set_silent(bool silent) noexcept {
  const std::lock_guard lock(mutex_);
  silent_ = silent;
}

// Serves function 3: unit, 03, first register, number of registers.
std::vector<std::uint8_t> ModbusSensorDevice::serve(std::span<const std::uint8_t> request) {
  const std::lock_guard lock(mutex_);
  if (silent_ || request.size() < 2) return {};
  const auto exception = [&](std::uint8_t code) {
    return std::vector<std::uint8_t>{request[0], static_cast<std::uint8_t>(request[1] | 0x80U), code};
  };
  if (request[1] != 3) return exception(illegal_function);
  if (request.size() != 6) return exception(illegal_value);
  const int first = request[2] << 8 | request[3], count = request[4] << 8 | request[5];
  if (count < 1 || count > 125) return exception(illegal_value);
  if (first < registers_.at || first + count > registers_.at + registers_.count) return exception(illegal_address);
  std::vector<std::uint8_t> answer{request[0], request[1], static_cast<std::uint8_t>(2 * count)};
  const auto* from = bytes_.begin() + 2 * (first - registers_.at);
  answer.insert(answer.end(), from, from + 2 * count);
  return answer;
}

}  // namespace proxarm::sim
