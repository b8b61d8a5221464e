#include "models/description/modbus_drive.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {
namespace {

constexpr int most_read = 125, most_written = 121;  // limits of function 23
constexpr std::int64_t highest_register = 0xFFFF;

std::uint16_t read_register(const YamlNode& node, std::string_view key) {
  return static_cast<std::uint16_t>(node.integer(key, 0, highest_register));
}

int read_width(const YamlNode& node) { return static_cast<int>(integer_of_or(node, "registers", 2, {1, 2})); }

// Reads a value that fits into one or two registers, signed or unsigned.
std::int64_t read_value(const YamlNode& node, std::string_view key, std::int64_t otherwise, int registers,
                        bool is_signed = true) {
  const std::int64_t low = !is_signed ? 0 : registers == 1 ? -0x8000 : std::numeric_limits<std::int32_t>::min();
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
  if (v.signal == Signal::constant) require_key(node, "value", "a number, or a signal");
  const bool has_value = v.signal == Signal::constant || v.signal == Signal::speed;
  if (!has_value) refuse_key(node, "value", "no value for signal: " + signal);
  if (v.signal != Signal::position && v.signal != Signal::speed) {
    refuse_key(node, "scale", "a scale for signal: position or speed only");
  }
  v.value = read_value(node, "value", 0, v.registers, v.signal != Signal::speed);  // the lowest speed isn't negative
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

int count_of(const ModbusDriveDescription& drive, ModbusValue::Signal signal) {
  return static_cast<int>(std::count_if(drive.command.begin(), drive.command.end(),
                                        [&](const ModbusValue& value) { return value.signal == signal; }));
}

// A block of registers. Registers that are written must not overlap each other or registers that are read.
struct Registers {
  int first, count;
  std::string name;
};

void claim(const YamlNode& node, std::vector<Registers>& taken, const Registers& block) {
  for (const Registers& other : taken) {
    if (block.first + block.count <= other.first || other.first + other.count <= block.first) continue;
    throw node.error_at("register", "registers of its own",
                        block.name + " in " + std::to_string(block.first) + " to " +
                            std::to_string(block.first + block.count - 1) + ", which overlap those of " + other.name +
                            ", " + std::to_string(other.first) + " to " +
                            std::to_string(other.first + other.count - 1));
  }
  taken.push_back(block);
}

void check_overlaps(const YamlNode& root, const ModbusDriveDescription& drive) {
  const YamlNode feedback = root.map("feedback");
  std::vector<Registers> taken;
  claim(root.map("command"), taken, {drive.command_register, drive.command_count(), "the command"});
  claim(feedback.map("position"), taken, {drive.position.at, drive.position.registers, "the position"});
  claim(feedback.map("status"), taken, {drive.status.at, drive.status.registers, "the status"});
  if (!root.has("settings")) return;
  const auto nodes = root.list("settings", 0, 64);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const ModbusSetting& setting = drive.settings[i];
    claim(nodes[i], taken, {setting.at, setting.registers, "setting " + in_quotes(setting.name)});
  }
}

void read_control(const YamlNode& node, ModbusDriveDescription& drive) {
  drive.control_on = read_value(node, "on", 0, 2);
  drive.control_off = read_value(node, "off", 0, 2);
  const auto word = std::find_if(drive.command.begin(), drive.command.end(),
                                 [](const ModbusValue& value) { return value.signal == ModbusValue::Signal::control; });
  if (word == drive.command.end()) {
    if (drive.control_on != drive.control_off) {
      throw node.error_at("on", "the same as `off`: no value of the command has signal: control");
    }
    return;
  }
  for (const char* key : {"on", "off"}) (void)read_value(node, key, 0, word->registers);
  if (drive.control_on == drive.control_off) throw node.error_at("on", "a control word other than `off`");
}

// Checks that masks contain only bits of the status word, and that the bits of a fault are clear in the values for
// ready and enabled.
void check_status(const YamlNode& node, const ModbusDriveDescription& drive) {
  const std::uint32_t bits = drive.status.registers == 1 ? 0xFFFF : 0xFFFFFFFF;
  const std::tuple<const char*, std::uint32_t, std::uint32_t> masks[] = {
      {"ready_mask", drive.ready_mask, bits},
      {"ready_value", drive.ready_value, drive.ready_mask},
      {"enabled_mask", drive.enabled_mask, bits},
      {"enabled_value", drive.enabled_value, drive.enabled_mask},
      {"fault_mask", drive.fault_mask, bits}};
  for (const auto& [key, value, allowed] : masks) {
    if ((value & ~allowed) == 0) continue;
    throw node.error_at(key, allowed == bits
                                 ? "bits of a status word of " + std::to_string(drive.status.registers) + " register(s)"
                                 : "bits of its mask alone: this status would never be seen");
  }
  if (((drive.ready_value | drive.enabled_value) & drive.fault_mask) != 0) {
    throw node.error_at("fault_mask", "bits that are clear while the drive is ready and driven");
  }
  if (drive.enabled_mask == 0 && count_of(drive, ModbusValue::Signal::control) > 0) {
    throw node.error_at("enabled_mask", "the bits that say that the motor is driven: the control word switches it");
  }
}

void read_command(const YamlNode& node, ModbusDriveDescription& drive) {
  using Signal = ModbusValue::Signal;
  drive.command_register = read_register(node, "register");
  for (const YamlNode& value : node.list("values", 1, most_written)) drive.command.push_back(read_command_value(value));
  if (count_of(drive, Signal::position) != 1) throw node.error_at("values", "exactly one value with signal: position");
  if (count_of(drive, Signal::speed) > 1 || count_of(drive, Signal::control) > 1) {
    throw node.error_at("values", "at most one value with signal: speed, and one with signal: control");
  }
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
  check_status(status, drive);
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
  read_control(root.map("control"), drive);
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
  check_overlaps(root, drive);
  root.finish();
  return drive;
}

}  // namespace proxarm::description
