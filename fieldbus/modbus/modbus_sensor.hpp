// A force sensor on a Modbus line that is known only by its description file. The line's worker reads the registers of
// a sample with function 3 at the file's rate. The sample is decoded like that of a described sensor on CAN
// (described_sensor.hpp), with two bytes per register, high byte first.
//
// Two threads use this class: the line's worker, which makes the exchanges, and the cycle, which uses the functions of
// ForceSensor and never waits. A failed exchange counts as a missing sample.
#pragma once

#include <atomic>

#include "fieldbus/modbus/modbus_client.hpp"
#include "fieldbus/sensors/described_sensor.hpp"
#include "models/base/triple_buffer.hpp"

namespace proxarm::fieldbus {

class ModbusSensor final : public ForceSensor {
 public:
  // Throws SetupError if the description file isn't that of a Modbus sensor, or if the unit isn't 1 to 247.
  ModbusSensor(const description::SensorDescription& sensor, std::uint32_t unit, const std::string& line);

  // Must be called before the cycle. Throws SetupError if the sensor doesn't answer.
  void start_up(ModbusClient& client, std::int64_t now_ns);
  void exchange(ModbusClient& client, std::int64_t now_ns) noexcept;
  [[nodiscard]] double rate_Hz() const noexcept { return protocol_.rate_Hz; }
  [[nodiscard]] int register_count() const noexcept { return protocol_.registers->count; }
  [[nodiscard]] double response_timeout_s() const noexcept { return protocol_.registers->response_timeout_s; }

  // ---- cycle thread ----
  [[nodiscard]] std::vector<std::uint32_t> wanted_ids() const override { return {}; }
  void start(CanNetwork&, std::size_t, const FrameHandler&) override {}  // start_up() starts the sensor
  [[nodiscard]] std::string identity() const override;
  bool poll(std::int64_t now_ns, CanFrame& frame) noexcept override;
  bool on_frame(const CanFrame&, std::int64_t) noexcept override { return false; }
  [[nodiscard]] bool fresh() const noexcept override { return decoder_.fresh(); }
  [[nodiscard]] const ForceSample& latest() const noexcept override { return decoder_.latest(); }
  void archive(StateArchive& state) noexcept override { decoder_.archive(state); }
  void archive_input(StateArchive& state) noexcept override;
  [[nodiscard]] std::string describe_status(std::uint32_t status) const override {
    return decoder_.describe_status(status);
  }
  [[nodiscard]] std::string describe_losses() const override;

 private:
  struct Sample {
    CanFrame frame;
    std::int64_t time_ns = 0;

    void archive(StateArchive& state) noexcept { state(frame.data, time_ns); }
  };

  description::SensorProtocol protocol_;
  std::string line_;
  std::uint8_t unit_;
  DescribedSensor decoder_;
  TripleBuffer<Sample> samples_;
  std::atomic<std::uint64_t> failures_{0};
  std::atomic<ModbusResult> last_failure_{ModbusResult::ok};
  Sample read_;   // used by the worker
  Sample taken_;  // used by the cycle
  bool took_ = false;
};

}  // namespace proxarm::fieldbus
