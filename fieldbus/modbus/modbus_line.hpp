// A Modbus line's worker: exchanges with each of its drives in turn, at the rate that they ask for or as fast as the
// line answers.
//
// On a real line run() in a thread of its own. In a simulation whoever owns the virtual clock calls step() when it
// says.
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

// Time on the wire of one exchange over a serial line: request and answer, 11 bits a character (10 without parity and
// with one stop bit), and after each the silence of 3.5 characters, at least 1.75 ms above 19,200 baud.
[[nodiscard]] double modbus_rtu_exchange_s(const description::ModbusDriveDescription& drive,
                                           const description::ModbusLineDescription& line) noexcept;
// The same of `registers` that are read by function 3.
[[nodiscard]] double modbus_rtu_read_s(int registers, const description::ModbusLineDescription& line) noexcept;
// Exchanges a second with each of `drives` units that can be expected: the drive's own wish, or what the line carries.
[[nodiscard]] double modbus_expected_rate_Hz(const description::ModbusDriveDescription& drive,
                                             const description::ModbusLineDescription& line, int drives) noexcept;

class ModbusLine {
 public:
  // Drives and sensor (null: none on this line) must outlive the line. Line and client are opened already.
  ModbusLine(const description::ModbusLineDescription& line, std::unique_ptr<ModbusClient> client,
             std::vector<ModbusDrive*> drives, ModbusSensor* sensor = nullptr);
  ModbusLine(const ModbusLine&) = delete;
  ModbusLine& operator=(const ModbusLine&) = delete;
  ~ModbusLine() { stop(); }

  [[nodiscard]] const description::ModbusLineDescription& description() const noexcept { return line_; }
  [[nodiscard]] const std::vector<ModbusDrive*>& drives() const noexcept { return drives_; }

  // Settings written and read back, positions read. Throws SetupError.
  void start_up(std::int64_t now_ns);
  // What an exchange takes on the wire, at most.
  [[nodiscard]] double exchange_s() const noexcept;
  // One exchange with the drive or sensor whose turn it is; returns when the next is due.
  std::int64_t step(std::int64_t now_ns) noexcept;
  // The worker: step() on CLOCK_MONOTONIC until stop().
  void start();
  void stop() noexcept;

 private:
  void run() noexcept;

  description::ModbusLineDescription line_;
  std::unique_ptr<ModbusClient> client_;
  std::vector<ModbusDrive*> drives_;
  ModbusSensor* sensor_;
  std::int64_t interval_ns_;  // between exchanges with one drive
  std::int64_t next_ns_ = 0;
  std::size_t turn_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace proxarm::fieldbus
