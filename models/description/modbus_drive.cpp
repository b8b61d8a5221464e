#include "models/description/modbus_drive.hpp"

#include <limits>

#include "models/description/yaml_file.hpp"

namespace proxarm::description {
namespace {

constexpr int most_read = 125, most_written = 121;  // of function 23, by its definition
constexpr std::int64_t highest_register = 0xFFFF;

std::uint16_t read_register(const YamlNode& node, std::string_view key) {
  return static_cast<std::uint16_t>(node.integer(key, 0, highest_register));
}

int read_width(const YamlNode& node) { return static_cast<int>(node.integer_or("registers", 2, 1, 2)); }

// What fits: signed or unsigned, 16 or 32 bits.
std::int64_t read_value(const YamlNode& node, std::string_view key, std::int64_t otherwise, int registers) {
  const std::int64_t low = registers == 1 ? -0x8000 : std::numeric_limits<std::int32_t>::min();
  const std::int64_t high = registers == 1 ? 0xFFFF : 0xFFFFFFFF;
  return node.integer_or(key, otherwise, low, high);
}

ModbusValue read_command_value(const YamlNode& node) {
  using Signal = ModbusValue::Signal;
  ModbusValue v;
  v.registers = read_width(node);
  const std::string signal = node.choice_or("signal", "constant", {"constant", "position", "speed", "control"});
  v.signal = signal == "position"  ? Signal::position
             : signal == "speed"   ? Signal::speed
             : signal == "control" ? Signal::control
                                   : Signal::constant;
  if (v.signal == Signal::constant && !node.has("value")) throw node.error_at("value", "a number, or a signal");
  v.value = read_value(node, "value", 0, v.registers);
  v.scale = node.number_or("scale", 1.0, above(0.0, 1e9));
  return v;
}

ModbusField read_field(const YamlNode& node) { return {read_register(node, "register"), read_width(node)}; }

bool is_read(const ModbusField& field, const ModbusDriveDescription& drive) {
  return field.at >= drive.feedback_register &&
         field.at + field.registers <= drive.feedback_register + drive.feedback_count;
}

std::uint32_t read_mask(const YamlNode& node, std::string_view key, std::uint32_t otherwise) {
  return static_cast<std::uint32_t>(node.integer_or(key, otherwise, 0, 0xFFFFFFFF));
}

void read_command(const YamlNode& node, ModbusDriveDescription& drive) {
  drive.command_register = read_register(node, "register");
  int positions = 0;
  for (const YamlNode& value : node.list("values", 1, most_written)) {
    drive.command.push_back(read_command_value(value));
    positions += drive.command.back().signal == ModbusValue::Signal::position ? 1 : 0;
  }
  if (positions != 1) throw node.error_at("values", "exactly one value with signal: position");
  if (drive.command_count() > most_written || drive.command_register + drive.command_count() > highest_register + 1) {
    throw node.error_at("values", "at most 121 registers, none above 65535", std::to_string(drive.command_count()));
  }
}

void read_feedback(const YamlNode& node, ModbusDriveDescription& drive) {
  drive.feedback_register = read_register(node, "register");
  drive.feedback_count = static_cast<int>(node.integer("count", 1, most_read));
  if (drive.feedback_register + drive.feedback_count > highest_register + 1) {
    throw node.error_at("count", "no register above 65535");
  }
  const YamlNode position = node.map("position");
  drive.position = read_field(position);
  if (!is_read(drive.position, drive)) {
    throw position.error_at("register", "registers among those that are read, " +
                                            std::to_string(drive.feedback_register) + " to " +
                                            std::to_string(drive.feedback_register + drive.feedback_count - 1));
  }
  const YamlNode status = node.map("status");
  drive.status = read_field(status);
  drive.status_every = static_cast<int>(node.integer_or("status_every", 1, 1, 1000));
  drive.ready_mask = read_mask(status, "ready_mask", 0);
  drive.ready_value = read_mask(status, "ready_value", drive.ready_mask);
  drive.enabled_mask = read_mask(status, "enabled_mask", 0);
  drive.enabled_value = read_mask(status, "enabled_value", drive.enabled_mask);
  drive.fault_mask = read_mask(status, "fault_mask", 0);
}

}  // namespace

int ModbusDriveDescription::command_count() const noexcept {
  int count = 0;
  for (const ModbusValue& value : command) count += value.registers;
  return count;
}

bool ModbusDriveDescription::status_apart() const noexcept { return !is_read(status, *this); }

ModbusDriveDescription load_modbus_drive(const std::filesystem::path& file) {
  return read_modbus_drive(YamlNode::load(file));
}

ModbusDriveDescription read_modbus_drive(const YamlNode& root) {
  ModbusDriveDescription drive;
  drive.file = std::filesystem::absolute(root.file()).lexically_normal();
  drive.name = root.string("name");
  (void)root.choice("protocol", {"modbus"});
  drive.high_word_first = root.choice_or("word_order", "high_first", {"high_first", "low_first"}) == "high_first";
  drive.function_23 = root.boolean_or("function_23", true);
  drive.rate_Hz = root.number_or("rate_Hz", drive.rate_Hz, 1.0, 1000.0);
  drive.response_timeout_s = root.number_or("response_timeout_s", drive.response_timeout_s, 0.001, 1.0);
  drive.stale_after_s = root.number_or("stale_after_s", drive.stale_after_s, above(0.0, 2.0));
  if (drive.stale_after_s < 2.0 / drive.rate_Hz || drive.stale_after_s < drive.response_timeout_s) {
    throw root.error_at("stale_after_s", "at least two periods of rate_Hz, and at least response_timeout_s");
  }
  read_command(root.map("command"), drive);
  const YamlNode control = root.map("control");
  drive.control_on = read_value(control, "on", 0, 2);
  drive.control_off = read_value(control, "off", 0, 2);
  read_feedback(root.map("feedback"), drive);
  if (root.has("settings")) {
    for (const YamlNode& node : root.list("settings", 0, 64)) {
      ModbusSetting setting;
      setting.name = node.string("name");
      setting.at = read_register(node, "register");
      setting.registers = read_width(node);
      setting.value = read_value(node, "value", 0, setting.registers);
      drive.settings.push_back(setting);
    }
  }
  root.finish();
  return drive;
}

}  // namespace proxarm::description
