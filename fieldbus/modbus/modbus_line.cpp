#include "fieldbus/modbus/modbus_line.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace proxarm::fieldbus {

namespace {

constexpr double tcp_exchange_s = 1e-3;  // assumed for a device with its own network connection

double rtu_s(double characters, double silences, const description::ModbusLineDescription& line) noexcept {
  const double character_bits = 1 + 8 + (line.parity == "none" ? 0 : 1) + line.stop_bits;
  const double character_s = character_bits / line.baud;
  return characters * character_s + silences * (line.baud > 19'200 ? 1.75e-3 : 3.5 * character_s);
}

}  // namespace

double modbus_rtu_read_s(int registers, const description::ModbusLineDescription& line) noexcept {
  return rtu_s(8.0 + 5.0 + 2.0 * registers, 2.0, line);
}

double modbus_rtu_exchange_s(const description::ModbusDriveDescription& drive,
                             const description::ModbusLineDescription& line) noexcept {
  const int written = 2 * drive.command_count(), read = 2 * drive.feedback_count;
  // Number of characters with checksums, where `written` and `read` count data bytes:
  // - function 23: request 11 + written + 2, answer 3 + read + 2
  // - function 16: request 9 + written, answer 8
  // - function 3: request 8, answer 5 + read
  const double characters = drive.function_23 ? 13.0 + written + 5.0 + read : 9.0 + written + 8.0 + 8.0 + 5.0 + read;
  const double silences = drive.function_23 ? 2.0 : 4.0;
  return rtu_s(characters, silences, line);
}

double modbus_expected_rate_Hz(const description::ModbusDriveDescription& drive,
                               const description::ModbusLineDescription& line, int drives) noexcept {
  if (!line.serial()) return drive.rate_Hz;
  return std::min(drive.rate_Hz, 1.0 / (modbus_rtu_exchange_s(drive, line) * std::max(drives, 1)));
}

ModbusLine::ModbusLine(const description::ModbusLineDescription& line, std::unique_ptr<ModbusClient> client,
                       std::vector<ModbusDrive*> drives, ModbusSensor* sensor)
    : line_(line), client_(std::move(client)), drives_(std::move(drives)), sensor_(sensor) {
  const int devices = static_cast<int>(drives_.size()) + (sensor_ == nullptr ? 0 : 1);
  double rate_Hz = 1000.0;
  for (const ModbusDrive* drive : drives_) {
    rate_Hz = std::min(rate_Hz, modbus_expected_rate_Hz(drive->registers(), line_, devices));
  }
  if (sensor_ != nullptr) {
    rate_Hz = std::min(rate_Hz, sensor_->rate_Hz());
    if (line_.serial())
      rate_Hz = std::min(rate_Hz, 1.0 / (devices * modbus_rtu_read_s(sensor_->register_count(), line_)));
  }
  interval_ns_ = std::llround(1e9 / rate_Hz);
}

void ModbusLine::start_up(std::int64_t now_ns) {
  for (ModbusDrive* drive : drives_) drive->start_up(*client_, now_ns);
  if (sensor_ != nullptr) sensor_->start_up(*client_, now_ns);
  next_ns_ = now_ns;
}

double ModbusLine::exchange_s() const noexcept {
  if (!line_.serial()) return tcp_exchange_s;
  double longest_s = sensor_ == nullptr ? 0.0 : modbus_rtu_read_s(sensor_->register_count(), line_);
  for (const ModbusDrive* drive : drives_) {
    longest_s = std::max(longest_s, modbus_rtu_exchange_s(drive->registers(), line_));
  }
  return longest_s;
}

std::int64_t ModbusLine::step(std::int64_t now_ns) noexcept {
  const std::size_t devices = drives_.size() + (sensor_ == nullptr ? 0 : 1);
  if (turn_ < drives_.size()) {
    drives_[turn_]->exchange(*client_, now_ns, interval_ns_);
  } else {
    sensor_->exchange(*client_, now_ns);
  }
  turn_ = (turn_ + 1) % devices;
  // If the line is slower than the wanted rate, the next exchange starts at once. Missed exchanges aren't made up for.
  next_ns_ = std::max(next_ns_ + interval_ns_ / static_cast<std::int64_t>(devices), now_ns);
  return next_ns_;
}

void ModbusLine::start() {
  thread_ = std::thread([this] { run(); });
}

void ModbusLine::stop() noexcept {
  stop_.store(true, std::memory_order_relaxed);
  if (thread_.joinable()) thread_.join();
}

void ModbusLine::run() noexcept {
  using Clock = std::chrono::steady_clock;
  const auto now_ns = [] {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
  };
  while (!stop_.load(std::memory_order_relaxed)) {
    const std::int64_t next_ns = step(now_ns());
    std::this_thread::sleep_until(Clock::time_point(std::chrono::nanoseconds(next_ns)));
  }
}

}  // namespace proxarm::fieldbus
