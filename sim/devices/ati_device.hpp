// A simulated ATI Net CAN OEM force/torque sensor: answers the requests of the maker's protocol.
//
// Identifier = base << 4 | operation; all numbers are big-endian. A request has its operation's identifier, and so has
// each frame of the answer:
//   request            answers
//   0  (empty)         0: status u16, SG0, SG2, SG4 (i16)      1: SG1, SG3, SG5 (i16)
//   2  row u8, 0..5    2, 3, 4: two floats each, the row of the calibration matrix
//   5  (empty)         5: serial number, 8 characters
//   6  index u8        6: index of the calibration that is now active
//   7  (empty)         7: counts per unit of force u32, counts per unit of torque u32
//   8  (empty)         8: unit of force u8 (2 is N), unit of torque u8 (3 is Nm)
//   9  index u8        9: converter voltage u16
//   C  (empty)         no answer: the sensor restarts
//   F  (empty)         F: major u8, minor u8, build u16
// Wrench = matrix · (SG − bias) / counts per unit. Other frames get no answer.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "sim/bus/device_port.hpp"
#include "sim/devices/sensor_faults.hpp"

namespace proxarm::sim {

// The converter that supplies the samples.
class GaugeSource {
 public:
  GaugeSource() = default;
  GaugeSource(const GaugeSource&) = delete;
  GaugeSource& operator=(const GaugeSource&) = delete;
  virtual ~GaugeSource() = default;

  // Returns the latest sample that is finished at time_ns.
  [[nodiscard]] virtual std::array<std::int16_t, 6> gauges(std::int64_t time_ns) noexcept = 0;
};

struct AtiDeviceConfig {
  std::uint32_t base_id = 0x68;  // 0..7F
  std::array<std::array<float, 6>, 6> matrix{};
  std::uint32_t counts_per_force = 1'000'000;
  std::uint32_t counts_per_torque = 1'000'000;
  std::string serial_number = "SIM00001";   // cut, or padded with blanks, to 8 characters
  std::int64_t answer_time_ns = 30'000;     // time from a request to its answer
  std::int64_t start_time_ns = 10'000'000;  // time from power on or reset to the first answer
};

class AtiDevice final : public BusDevice {
 public:
  AtiDevice(const AtiDeviceConfig& config, GaugeSource& gauges, DevicePort& port);

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void on_time(std::int64_t) noexcept override {}

  [[nodiscard]] SensorFaults& faults() noexcept { return faults_; }

 private:
  void send_sample(std::int64_t time_ns) noexcept;
  void send_matrix_row(std::size_t row, std::int64_t time_ns) noexcept;
  void send_sample_frame(std::uint8_t operation, std::span<const std::uint8_t> bytes, std::int64_t time_ns) noexcept;
  void answer(std::uint8_t operation, std::span<const std::uint8_t> bytes, std::int64_t time_ns) noexcept;

  AtiDeviceConfig config_;
  GaugeSource& gauges_;
  DevicePort& port_;
  SensorFaults faults_;
  std::array<std::int16_t, 6> last_{};
  std::uint8_t calibration_ = 0;
  std::uint64_t frames_ = 0;
  std::int64_t ready_ns_ = INT64_MAX;
};

}  // namespace proxarm::sim
