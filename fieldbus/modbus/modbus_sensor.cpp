#include "fieldbus/modbus/modbus_sensor.hpp"

#include <array>

#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

const description::SensorProtocol& checked(const description::SensorDescription& sensor, std::uint32_t unit) {
  if (!sensor.described || !sensor.described->registers) {
    throw SetupError({.file = sensor.file.string(), .key = "registers", .expected = "those of a sensor on Modbus"});
  }
  if (unit < 1 || unit > 247) {
    throw SetupError({.key = "sensor.base_id",
                      .found = std::to_string(unit),
                      .expected = "the Modbus unit of " + sensor.name + ", 1 to 247"});
  }
  return *sensor.described;
}

}  // namespace

ModbusSensor::ModbusSensor(const description::SensorDescription& sensor, std::uint32_t unit, const std::string& line)
    : protocol_(checked(sensor, unit)),
      line_(line),
      unit_(static_cast<std::uint8_t>(unit)),
      decoder_(sensor, {.bus_name = line}) {
  const description::SampleFrame& whole = protocol_.frames.front();
  read_.frame.id = whole.id;
  read_.frame.fd = protocol_.fd;
  read_.frame.length = whole.bytes;
}

void ModbusSensor::exchange(ModbusClient& client, std::int64_t now_ns) noexcept {
  std::array<std::uint16_t, description::max_sensor_registers> values{};
  const auto count = static_cast<std::size_t>(protocol_.registers->count);
  const ModbusResult result = client.read(unit_, protocol_.registers->at, {values.data(), count});
  if (result != ModbusResult::ok) {
    last_failure_.store(result, std::memory_order_relaxed);
    failures_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    read_.frame.data[2 * i] = static_cast<std::uint8_t>(values[i] >> 8);
    read_.frame.data[2 * i + 1] = static_cast<std::uint8_t>(values[i]);
  }
  read_.time_ns = now_ns;
  samples_.write(read_);
}

void ModbusSensor::start_up(ModbusClient& client, std::int64_t now_ns) {
  constexpr int attempts = 3;
  for (int i = 0; i < attempts; ++i) {
    exchange(client, now_ns);
    if (samples_.read(taken_)) return;
  }
  throw SetupError({.bus = line_,
                    .node = unit_,
                    .message = "force sensor: registers " + std::to_string(protocol_.registers->at) + " and up",
                    .found = "no answer",
                    .advice = "is it powered, and are its unit, baud rate and parity those of the cell file?"});
}

std::string ModbusSensor::identity() const {
  return decoder_.identity() + ", unit " + std::to_string(unit_) + " of Modbus line " + line_;
}

std::string ModbusSensor::describe_losses() const {
  const std::uint64_t failures = failures_.load(std::memory_order_relaxed);
  if (failures == 0) return {};
  constexpr std::array why{"",
                           "no answer",
                           "the connection was closed",
                           "an exception",
                           "another unit answered",
                           "an answer that isn't one"};
  return losses_text({{failures, "reads failed, the last: "}}) +
         why[static_cast<std::size_t>(last_failure_.load(std::memory_order_relaxed))];
}

bool ModbusSensor::poll(std::int64_t now_ns, CanFrame& frame) noexcept {
  decoder_.poll(now_ns, frame);
  took_ = samples_.read(taken_);
  if (took_) decoder_.on_frame(taken_.frame, taken_.time_ns);
  return false;
}

void ModbusSensor::archive_input(StateArchive& state) noexcept {
  bool took = took_;
  // read_ and taken_ have the same identifier and length, which aren't archived
  Sample sample = state.reading() ? read_ : taken_;
  state(took, sample);
  if (state.reading() && took) samples_.write(sample);
}

}  // namespace proxarm::fieldbus
