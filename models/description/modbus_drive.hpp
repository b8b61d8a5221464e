// A Modbus drive's register map: the registers of target, position and status. A file under models/drives; another make
// needs only another file.
//
// Each exchange uses function 23 (read/write multiple registers), or functions 16 and 3 if the drive doesn't have it:
//   written  the block `command`, from command_register on: its values in order, one or two registers each
//   read     feedback_count registers from feedback_register; a status word outside of these by another function 3,
//            every status_every-th exchange
// All registers are holding registers, numbered from 0 as on the wire.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace proxarm::description {

class YamlNode;

// One value of the command block.
struct ModbusValue {
  enum class Signal : std::uint8_t {
    constant,  // `value`
    position,  // target, counts · scale
    speed,     // feed-forward: |counts per second| · scale, at least `value`
    control,   // control_on if the axis shall be driven, otherwise control_off
  };
  Signal signal = Signal::constant;
  int registers = 2;       // 1 or 2
  std::int64_t value = 0;  // constant, or lowest speed
  double scale = 1.0;      // register units per count or per count/s
};

// A value in the feedback: signed, one or two registers.
struct ModbusField {
  std::uint16_t at = 0;  // register
  int registers = 2;
};

// Written once at the start, read back and compared.
struct ModbusSetting {
  std::string name;
  std::uint16_t at = 0;
  int registers = 2;
  std::int64_t value = 0;
};

struct ModbusDriveDescription {
  std::filesystem::path file;
  std::string name;
  bool high_word_first = true;  // of values in two registers
  bool function_23 = true;
  double rate_Hz = 100.0;            // exchanges per second that the line aims at
  double response_timeout_s = 0.02;  // per exchange
  double stale_after_s = 0.1;        // without an answer for this long, the drive is lost
  std::uint16_t command_register = 0;
  std::vector<ModbusValue> command;
  std::int64_t control_on = 0, control_off = 0;
  std::uint16_t feedback_register = 0;
  int feedback_count = 0;
  ModbusField position;
  ModbusField status;
  int status_every = 1;
  std::uint32_t ready_mask = 0, ready_value = 0;      // ready for operation if (status & mask) = value
  std::uint32_t enabled_mask = 0, enabled_value = 0;  // driven if (status & mask) = value
  std::uint32_t fault_mask = 0;                       // fault if any of these bits is set
  std::vector<ModbusSetting> settings;

  [[nodiscard]] int command_count() const noexcept;  // registers
  [[nodiscard]] bool status_apart() const noexcept;  // true: status isn't among the feedback's registers
};

// Throws SetupError, with file, line and key.
ModbusDriveDescription load_modbus_drive(const std::filesystem::path& file);
ModbusDriveDescription read_modbus_drive(const YamlNode& root);

}  // namespace proxarm::description
