// The worker of a Modbus line. It makes exchanges with the line's drives and its sensor in turn, at the rate that the
// devices ask for, or as fast as the line allows if that is slower.
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

// Returns how long one exchange with a drive takes on a serial line, in s. It adds up request and answer with 11 bits
// per character (10 without parity and with one stop bit). Each message is followed by a silence of 3.5 characters,
// which lasts at least 1.75 ms above 19,200 baud.
[[nodiscard]] double modbus_rtu_exchange_s(const description::ModbusDriveDescription& drive,
                                           const description::ModbusLineDescription& line) noexcept;
// Returns how long reading `registers` registers with function 3 takes on a serial line, in s.
[[nodiscard]] double modbus_rtu_read_s(int registers, const description::ModbusLineDescription& line) noexcept;
// Returns the expected number of exchanges per second with each of `drives` units: the drive's wanted rate, or the rate
// that the line can carry if that is lower.
[[nodiscard]] double modbus_expected_rate_Hz(const description::ModbusDriveDescription& drive,
                                             const description::ModbusLineDescription& line, int drives) noexcept;

class ModbusLine {
 public:
  // Precondition: line and client are already open. The drives and the sensor (nullptr if the line has no sensor) must
  // outlive the ModbusLine.
  ModbusLine(const description::ModbusLineDescription& line, std::unique_ptr<ModbusClient> client,
             std::vector<ModbusDrive*> drives, ModbusSensor* sensor = nullptr);
  ModbusLine(const ModbusLine&) = delete;
  ModbusLine& operator=(const ModbusLine&) = delete;
  ~ModbusLine() { stop(); }

  [[nodiscard]] const description::ModbusLineDescription& description() const noexcept { return line_; }
  [[nodiscard]] const std::vector<ModbusDrive*>& drives() const noexcept { return drives_; }

  // Starts up all drives and the sensor: writes the settings and reads them back, and reads the positions. Throws
  // SetupError.
  void start_up(std::int64_t now_ns);
  // Returns the duration of the longest exchange on the wire in s.
  [[nodiscard]] double exchange_s() const noexcept;
  // Makes an exchange with the drive or sensor whose turn it is. Returns the time of the next exchange.
  std::int64_t step(std::int64_t now_ns) noexcept;
  // Starts the worker thread, which calls step() on CLOCK_MONOTONIC until stop().
  void start();
  void stop() noexcept;

 private:
  void run() noexcept;

  description::ModbusLineDescription line_;
  std::unique_ptr<ModbusClient> client_;
  std::vector<ModbusDrive*> drives_;
  ModbusSensor* sensor_;
  std::int64_t interval_ns_;  // time between two exchanges with the same device
  std::int64_t next_ns_ = 0;
  std::size_t turn_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace proxarm::fieldbus
