// A simulated force sensor on a Modbus line: offers the samples of a DescribedDevice as holding registers.
//
// The thread of the physics calls send() with a sample. A server's thread may call serve() at any time. A silent sensor
// doesn't answer.
#pragma once

#include <array>
#include <mutex>

#include "models/description/sensor.hpp"
#include "sim/bus/device_port.hpp"
#include "sim/devices/modbus_device.hpp"

namespace proxarm::sim {

class ModbusSensorDevice final : public ModbusUnit, public DevicePort {
 public:
  ModbusSensorDevice(const description::SensorRegisters& registers, std::uint8_t unit)
      : registers_(registers), unit_(unit) {}

  [[nodiscard]] std::uint8_t unit() const noexcept override { return unit_; }
  [[nodiscard]] std::vector<std::uint8_t> serve(std::span<const std::uint8_t> request) override;
  [[nodiscard]] ModbusFault fault() const noexcept override { return ModbusFault::none; }

  void send(const fieldbus::CanFrame& frame, std::int64_t ready_ns) noexcept override;
  void set_silent(bool silent) noexcept;

 private:
  description::SensorRegisters registers_;
  std::uint8_t unit_;
  mutable std::mutex mutex_;
  std::array<std::uint8_t, 64> bytes_{};
  bool silent_ = false;
};

}  // namespace proxarm::sim
