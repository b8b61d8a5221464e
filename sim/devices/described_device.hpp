// A simulated force sensor that follows a description file (models/description/sensor_protocol.hpp). It is the device
// for DescribedSensor, with which it shares no code.
//
// The sensor streams by its own clock or answers polls. It obeys commands whose bytes are those in the file: rate,
// start, stop, bias and clearing the bias. If the file has no start command, the sensor streams from power on.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "models/description/sensor.hpp"
#include "sim/bus/device_port.hpp"
#include "sim/devices/sensor_faults.hpp"

namespace proxarm::sim {

// The measuring part of the sensor. wrench() returns the wrench at time_ns: fx fy fz (N), tx ty tz (Nm).
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
  std::int64_t answer_time_ns = 30'000;     // time from a poll to the first frame of the answer
  std::int64_t start_time_ns = 10'000'000;  // time from power on until the sensor works
};

class DescribedDevice final : public BusDevice {
 public:
  // Throws SetupError if the matrix is singular, because the signals are computed from the wrench by the inverse
  // matrix.
  DescribedDevice(const description::SensorDescription& sensor, const DescribedDeviceConfig& config,
                  WrenchSource& source, DevicePort& port);

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void on_time(std::int64_t) noexcept override {}

  // Ends the conversion of a sample and sends the sample if the sensor streams. Must be called every period_ns().
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
  std::vector<std::array<double, 6>> signals_of_wrench_;  // inverse of the matrix, row by row
  std::array<double, 6> measured_{}, bias_{};
  std::array<double, 6> numbers_{};  // the signals of the last sample
  std::uint64_t count_ = 0, frames_ = 0;
  std::int64_t period_ns_ = 0, ready_ns_ = INT64_MAX;
  bool streaming_ = false;
};

}  // namespace proxarm::sim
