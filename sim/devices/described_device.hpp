// A simulated force sensor that follows a description file (models/description/sensor_protocol.hpp): the device for
// DescribedSensor, with which it shares no code.
//
// It streams by its own clock or answers polls. It obeys commands with the file's bytes: rate, start, stop, bias and
// clearing the bias. Without a start command, it streams from power on.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "models/description/sensor.hpp"
#include "sim/bus/device_port.hpp"
#include "sim/devices/sensor_faults.hpp"

namespace proxarm::sim {

// The measuring part: the wrench at a time, fx fy fz (N), tx ty tz (Nm).
class WrenchSource {
 public:
  WrenchSource() = default;
  WrenchSource(const WrenchSource&) = delete;
  WrenchSource& operator=(const WrenchSource&) = delete;
  virtual ~WrenchSource() = default;
  [[nodiscard]] virtual std::array<double, 6> wrench(std::int64_t time_ns) noexcept = 0;
};

struct DescribedDeviceConfig {
  std::uint32_t base_id = 0;
  std::int64_t answer_time_ns = 30'000;     // from a poll to the first frame of its answer
  std::int64_t start_time_ns = 10'000'000;  // from power on
};

class DescribedDevice final : public BusDevice {
 public:
  // Throws SetupError for a singular matrix: the wrench must determine the signals.
  DescribedDevice(const description::SensorDescription& sensor, const DescribedDeviceConfig& config,
                  WrenchSource& source, DevicePort& port);

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void on_time(std::int64_t) noexcept override {}

  // A sample is finished; call every period_ns().
  void on_converter(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool fd() const noexcept { return protocol_.fd; }
  [[nodiscard]] std::int64_t period_ns() const noexcept { return period_ns_; }
  [[nodiscard]] bool streaming() const noexcept { return streaming_; }
  [[nodiscard]] SensorFaults& faults() noexcept { return faults_; }

 private:
  [[nodiscard]] bool is(const std::optional<description::SensorCommand>& command,
                        const fieldbus::CanFrame& frame) const noexcept;
  void obey_rate(const fieldbus::CanFrame& frame) noexcept;
  void put(const description::NumberField& number, std::uint64_t value) noexcept;
  void fill(std::int64_t time_ns) noexcept;
  void fill_signals(std::int64_t time_ns) noexcept;
  void fill_checksum() noexcept;
  void send_sample(std::int64_t time_ns) noexcept;
  void send_part(std::size_t part, std::int64_t time_ns) noexcept;

  description::SensorProtocol protocol_;
  DescribedDeviceConfig config_;
  WrenchSource& source_;
  DevicePort& port_;
  SensorFaults faults_;
  std::vector<std::uint8_t> sample_;
  std::vector<std::array<double, 6>> signals_of_wrench_;  // inverse of the matrix, by rows
  std::array<double, 6> measured_{}, bias_{};
  std::array<double, 6> numbers_{};  // signals of the last sample
  std::uint64_t count_ = 0, frames_ = 0;
  std::int64_t period_ns_ = 0, ready_ns_ = INT64_MAX;
  bool streaming_ = false;
};

}  // namespace proxarm::sim
