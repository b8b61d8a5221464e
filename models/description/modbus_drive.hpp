// Describes a Modbus drive by its register map: the registers of target, position and status. The file is in
// models/drives. A drive of another maker needs only another file.
//
// Each exchange uses function 23 (read/write multiple registers), or functions 16 and 3 if the drive doesn't have
// function 23:
//   written  the block `command`, from command_register on: its values in order, in one or two registers each
//   read     feedback_count registers from feedback_register on. If the status word isn't among them, every
//            status_every-th exchange reads it by another function 3
// All registers are holding registers. Their numbers begin at 0, as on the wire.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace proxarm::description {

class YamlNode;

// One value of the block `command`.
struct ModbusValue {
  enum class Signal : std::uint8_t {
    constant,  // `value`
    position,  // the target: counts · scale
    speed,     // feed-forward: |counts per second| · scale, but at least `value`
    control,   // control_on if the axis is to be driven, otherwise control_off
  };
  Signal signal = Signal::constant;
  int registers = 2;       // 1 or 2
  std::int64_t value = 0;  // the constant, or the lowest speed
  double scale = 1.0;      // register units per count or per count/s
};

// A value in the feedback: a signed number in one or two registers.
struct ModbusField {
  std::uint16_t at = 0;  // register
  int registers = 2;
};

// A value that is written once at the start, and then read back and compared.
struct ModbusSetting {
  std::string name;
  std::uint16_t at = 0;
  int registers = 2;
  std::int64_t value = 0;
};

struct ModbusDriveDescription {
  std::filesystem::path file;
  std::string name;
  bool high_word_first = true;  // word order of values in two registers
  bool function_23 = true;
  double rate_Hz = 100.0;            // exchanges per second on the line, if the line can carry them
  double response_timeout_s = 0.02;  // longest time of one exchange
  double stale_after_s = 0.1;        // after this time without an answer, the drive counts as lost
  std::uint16_t command_register = 0;
  std::vector<ModbusValue> command;
  std::int64_t control_on = 0, control_off = 0;
  std::uint16_t feedback_register = 0;
  int feedback_count = 0;
  ModbusField position;
  ModbusField status;
  int status_every = 1;
  std::uint32_t ready_mask = 0, ready_value = 0;      // the drive is ready for operation if (status & mask) = value
  std::uint32_t enabled_mask = 0, enabled_value = 0;  // the axis is driven if (status & mask) = value
  std::uint32_t fault_mask = 0;                       // the drive has a fault if any of these bits is set
  std::vector<ModbusSetting> settings;

  [[nodiscard]] int command_count() const noexcept;  // number of registers of the command
  [[nodiscard]] bool status_apart() const noexcept;  // whether the status isn't among the feedback's registers
};

// Read a register map from a file, or from a file that has already been read. Both throw SetupError, with file, line
// and key.
ModbusDriveDescription load_modbus_drive(const std::filesystem::path& file);
ModbusDriveDescription read_modbus_drive(const YamlNode& root);

}  // namespace proxarm::description
