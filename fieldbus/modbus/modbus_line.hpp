// The worker of a Modbus line: exchanges with each of its drives in turn, at the rate they ask for or as fast as the
// line allows.
//
// On a real line, run() has its own thread. In simulation, the owner of the virtual clock calls step() at the times
// that step() returns.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "fieldbus/modbus/modbus_client.hpp"
#include "fieldbus/modbus/modbus_drive.hpp"
#include "fieldbus/modbus/modbus_sensor.hpp"

namespace proxarm::fieldbus {

// Time on the wire of one exchange over a serial line, in s: request and answer, 11 bits per character (10 without
// parity and with one stop bit), and after each a silence of 3.5 characters, at least 1.75 ms above 19,200 baud.
[[nodiscard]] double modbus_rtu_exchange_s(const description::ModbusDriveDescription& drive,
                                           const description::ModbusLineDescription& line) noexcept;
// The same for reading `registers` with function 3.
[[nodiscard]] double modbus_rtu_read_s(int registers, const description::ModbusLineDescription& line) noexcept;
// Expected exchanges per second with each of `drives` units: the rate the drive asks for, or what the line can carry.
[[nodiscard]] double modbus_expected_rate_Hz(const description::ModbusDriveDescription& drive,
                                             const description::ModbusLineDescription& line, int drives) noexcept;

class ModbusLine {
 public:
  // Drives and sensor (null if the line has none) must outlive the line. Line and client are already open.
  ModbusLine(const description::ModbusLineDescription& line, std::unique_ptr<ModbusClient> client,
             std::vector<ModbusDrive*> drives, ModbusSensor* sensor = nullptr);
  ModbusLine(const ModbusLine&) = delete;
  ModbusLine& operator=(const ModbusLine&) = delete;
  ~ModbusLine() { stop(); }

  [[nodiscard]] const description::ModbusLineDescription& description() const noexcept { return line_; }
  [[nodiscard]] const std::vector<ModbusDrive*>& drives() const noexcept { return drives_; }

  // Writes the settings and reads them back, reads the positions. Throws SetupError.
  void start_up(std::int64_t now_ns);
  // Longest time of an exchange on the wire, s.
  [[nodiscard]] double exchange_s() const noexcept;
  // Exchanges with the drive or sensor whose turn it is; returns the time of the next exchange.
  std::int64_t step(std::int64_t now_ns) noexcept;
  // Starts the worker thread: step() on CLOCK_MONOTONIC until stop().
  void start();
  void stop() noexcept;

 private:
  void run() noexcept;

  description::ModbusLineDescription line_;
  std::unique_ptr<ModbusClient> client_;
  std::vector<ModbusDrive*> drives_;
  ModbusSensor* sensor_;
  std::int64_t interval_ns_;  // between exchanges with the same drive
  std::int64_t next_ns_ = 0;
  std::size_t turn_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace proxarm::fieldbus
