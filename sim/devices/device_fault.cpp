#include "sim/devices/device_fault.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::sim {

namespace {

using description::SetupError;

constexpr unsigned can = 1, modbus = 2, drives = can | modbus, sensor = 4;  // bits of FaultyDevice
constexpr std::uint64_t none = 0, u16 = 0xFFFF, u24 = 0xFFFFFF, u32 = 0xFFFFFFFF, last_channel = 5, last_mode = 10,
                        longest_late_ms = 10'000, last_exception = 11, classic_bytes = 8;
constexpr std::uint32_t refused_by_value = 0x06090030;
using ParseAmount = double (*)(std::string_view text, std::string_view option);

struct KindName {
  const char* name;
  unsigned devices;  // devices that can have the fault, as bits
  DeviceFaultKind kind;
  // Maximum of the fault's VALUE; `none`: the fault has no VALUE.
  std::uint64_t most;
  ParseAmount parse_amount = nullptr;  // parses the AMOUNT of a fault that has one instead of a VALUE
  bool is_signed = false;
};

constexpr KindName kinds[] = {
    {"silent", drives, DeviceFaultKind::drive_silent, none},
    {"fault", can, DeviceFaultKind::drive_fault, u16},
    {"device_type", can, DeviceFaultKind::device_type, u32},
    {"lacks", can, DeviceFaultKind::object_missing, u24},
    {"fixed", can, DeviceFaultKind::object_fixed, u24},
    {"holds", can, DeviceFaultKind::object_holds, u24},
    {"refuses", can, DeviceFaultKind::value_refused, u24},
    {"wants_bits", can, DeviceFaultKind::bits_wanted, u16},
    {"mode_first", can, DeviceFaultKind::mode_first, none},
    {"mode_late", can, DeviceFaultKind::mode_late, none},
    {"homed", can, DeviceFaultKind::homed, none},
    {"heartbeat", can, DeviceFaultKind::heartbeat_lost, none},
    {"sdo", can, DeviceFaultKind::sdo_silent, none},
    {"period", can, DeviceFaultKind::period_fixed, none},
    {"sto", can, DeviceFaultKind::sto_open, none},
    {"bit12", can, DeviceFaultKind::bit_12_missing, none},
    {"mode", can, DeviceFaultKind::mode_changed, last_mode},
    {"twin", can, DeviceFaultKind::twin, none},
    {"sdo_late", can, DeviceFaultKind::sdo_late, longest_late_ms},
    {"sdo_stray", can, DeviceFaultKind::sdo_stray, none},
    {"sdo_sizeless", can, DeviceFaultKind::sdo_sizeless, none},
    {"sdo_doubled", can, DeviceFaultKind::sdo_doubled, none},
    {"guarding", can, DeviceFaultKind::guarding, none},
    {"boot_up", can, DeviceFaultKind::boot_up, none},
    {"warning", can, DeviceFaultKind::warning, u16},
    {"sync_lost", can, DeviceFaultKind::sync_lost, u16},
    {"tpdo_bytes", can, DeviceFaultKind::tpdo_bytes, classic_bytes},
    {"power", drives, DeviceFaultKind::power_loss, none},
    {"jammed", drives, DeviceFaultKind::jammed, none},
    {"runaway", drives, DeviceFaultKind::runaway, none, description::parse_angular_speed, true},
    {"reversed", drives, DeviceFaultKind::reversed, none},
    {"ignored", drives, DeviceFaultKind::ignored, none},
    {"weak", drives, DeviceFaultKind::weak, none, description::parse_torque},
    {"offset", drives, DeviceFaultKind::offset, none, description::parse_angle, true},
    {"stuck", drives, DeviceFaultKind::stuck, none},
    {"torque_stuck", can, DeviceFaultKind::torque_stuck, none},
    {"exception", modbus, DeviceFaultKind::modbus_exception, last_exception},
    {"lost", modbus, DeviceFaultKind::modbus_lost, u16},
    {"closed", modbus, DeviceFaultKind::modbus_closed, none},
    {"wrong_unit", modbus, DeviceFaultKind::modbus_wrong_unit, none},
    {"wrong_function", modbus, DeviceFaultKind::modbus_wrong_function, none},
    {"wrong_count", modbus, DeviceFaultKind::modbus_wrong_count, none},
    {"half_answer", modbus, DeviceFaultKind::modbus_half, none},
    {"low_first", modbus, DeviceFaultKind::modbus_low_first, none},
    {"forgets", modbus, DeviceFaultKind::modbus_forgets, none},
    {"no_function_23", modbus, DeviceFaultKind::modbus_no_function_23, none},
    {"not_ready", modbus, DeviceFaultKind::modbus_not_ready, none},
    {"not_driven", modbus, DeviceFaultKind::modbus_not_driven, none},
    {"tripped", modbus, DeviceFaultKind::modbus_tripped, none},
    {"silent", sensor, DeviceFaultKind::sensor_silent, none},
    {"samples", sensor, DeviceFaultKind::samples_missing, none},
    {"frozen", sensor, DeviceFaultKind::frozen, none},
    {"half", sensor, DeviceFaultKind::half_sample, none},
    {"swapped", sensor, DeviceFaultKind::swapped, none},
    {"duplicated", sensor, DeviceFaultKind::duplicated, none},
    {"short", sensor, DeviceFaultKind::short_frames, none},
    {"checksum", sensor, DeviceFaultKind::bad_checksum, none},
    {"saturated", sensor, DeviceFaultKind::saturated, none},
    {"lost", sensor, DeviceFaultKind::lost, u32},
    {"status", sensor, DeviceFaultKind::status, u32},
    {"channel", sensor, DeviceFaultKind::channel_stuck, last_channel},
    {"offset", sensor, DeviceFaultKind::sensor_offset, none, description::parse_force, true},
    {"drift", sensor, DeviceFaultKind::drift, none, description::parse_force_rate, true},
    {"scale", sensor, DeviceFaultKind::scale, none, description::parse_factor},
    {"inverted", sensor, DeviceFaultKind::inverted, none},
    {"turned", sensor, DeviceFaultKind::turned, none},
    {"delay", sensor, DeviceFaultKind::delay, u32},
};

[[noreturn]] void refuse(std::string_view text, std::string expected) {
  throw SetupError({.key = "--fault", .found = description::in_quotes(text), .expected = std::move(expected)});
}

std::string names_for(unsigned devices) {
  std::string names;
  for (const KindName& kind : kinds) {
    if ((kind.devices & devices) != 0) names += (names.empty() ? "" : ", ") + std::string(kind.name);
  }
  const char* whose = devices == sensor   ? "for the sensor: "
                      : devices == can    ? "for a drive on CAN: "
                      : devices == modbus ? "for a drive on Modbus: "
                                          : "for a drive: ";
  return whose + names;
}

std::uint32_t parse_value(std::string_view all, std::string_view text, std::uint64_t most) {
  const bool hex = text.substr(0, 2) == "0x";
  const std::string_view digits = hex ? text.substr(2) : text;
  std::uint32_t value = 0;
  const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), value, hex ? 16 : 10);
  if (digits.empty() || result.ec != std::errc{} || result.ptr != digits.data() + digits.size() || value > most) {
    refuse(all, "after '=' a number from 0 to " + std::to_string(most) + ", or 0x...");
  }
  return value;
}

double parse_amount(const KindName& kind, std::string_view text) {
  const bool negative = kind.is_signed && text.substr(0, 1) == "-";
  const double amount = kind.parse_amount(negative ? text.substr(1) : text, "--fault");
  return negative ? -amount : amount;
}

// Parses OBJECT:CONTENT. For `refuses`, CONTENT (the abort code) is optional.
void parse_object(std::string_view all, std::string_view text, const KindName& kind, DeviceFault& fault) {
  const std::size_t colon = text.find(':');
  const bool holds = kind.kind == DeviceFaultKind::object_holds, refuses = kind.kind == DeviceFaultKind::value_refused;
  if (colon == std::string_view::npos ? holds : !holds && !refuses) {
    refuse(all, holds ? "OBJECT:VALUE after '=', such as 0x140002:255" : "one number after '='");
  }
  fault.value = parse_value(all, text.substr(0, colon), kind.most);
  if (refuses) fault.content = refused_by_value;
  if (colon != std::string_view::npos) fault.content = parse_value(all, text.substr(colon + 1), u32);
}

std::int64_t parse_time_ns(std::string_view text) {
  if (text == "0" || text == "0s") return 0;
  return std::llround(description::parse_duration(text, "--fault") * 1e9);
}

}  // namespace

void require_known_fault(const DeviceFault& fault, FaultyDevice device) {
  const auto devices = static_cast<unsigned>(device);
  for (const KindName& kind : kinds) {
    if (kind.kind != fault.kind || (kind.devices & devices) != 0) continue;
    throw SetupError(
        {.key = "--fault", .found = std::string(kind.name) + " for " + fault.device, .expected = names_for(devices)});
  }
}

DeviceFault parse_device_fault(std::string_view text) {
  const std::string_view all = text;
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos || colon == 0) refuse(all, "DEVICE:KIND[=VALUE][@FROM[..UNTIL]]");
  DeviceFault fault;
  fault.device = std::string(text.substr(0, colon));
  text.remove_prefix(colon + 1);
  const std::size_t at = text.find('@');
  const std::string_view times = at == std::string_view::npos ? std::string_view{} : text.substr(at + 1);
  const std::string_view what = text.substr(0, at);
  const std::size_t equals = what.find('=');
  const bool has_value = equals != std::string_view::npos;
  const unsigned devices = fault.device == "sensor" ? sensor : drives;
  const KindName* found = nullptr;
  for (const KindName& kind : kinds) {
    if ((kind.devices & devices) != 0 && what.substr(0, equals) == kind.name) found = &kind;
  }
  if (found == nullptr) refuse(all, names_for(devices));
  if (has_value != (found->most != none || found->parse_amount != nullptr)) {
    refuse(all, has_value ? "no value for this kind of fault" : "a value, KIND=VALUE");
  }
  fault.kind = found->kind;
  if (found->parse_amount != nullptr) {
    fault.amount = parse_amount(*found, what.substr(equals + 1));
  } else if (has_value) {
    parse_object(all, what.substr(equals + 1), *found, fault);
  }
  if (at == std::string_view::npos) return fault;
  constexpr DeviceFaultKind made_so[] = {
      DeviceFaultKind::device_type,  DeviceFaultKind::object_missing, DeviceFaultKind::object_fixed,
      DeviceFaultKind::object_holds, DeviceFaultKind::value_refused,  DeviceFaultKind::bits_wanted,
      DeviceFaultKind::mode_first,   DeviceFaultKind::mode_late,      DeviceFaultKind::homed};
  if (std::find(std::begin(made_so), std::end(made_so), fault.kind) != std::end(made_so))
    refuse(all, "no time: a device is what it is from the start");
  const std::size_t dots = times.find("..");
  fault.from_ns = parse_time_ns(times.substr(0, dots));
  if (dots != std::string_view::npos) fault.until_ns = parse_time_ns(times.substr(dots + 2));
  if (fault.until_ns <= fault.from_ns) refuse(all, "an end after the beginning, such as @2s..3s");
  return fault;
}

}  // namespace proxarm::sim
