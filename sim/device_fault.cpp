#include "sim/device_fault.hpp"

#include <charconv>
#include <cmath>

#include "models/description/quantity.hpp"
#include "models/description/setup_error.hpp"

namespace proxarm::sim {

namespace {

using description::SetupError;

enum class Value : std::uint8_t { none, needed };

struct KindName {
  const char* name;
  bool of_sensor;
  DeviceFaultKind kind;
  Value value;
};

constexpr KindName kinds[] = {
    {"silent", false, DeviceFaultKind::drive_silent, Value::none},
    {"fault", false, DeviceFaultKind::drive_fault, Value::needed},
    {"device_type", false, DeviceFaultKind::device_type, Value::needed},
    {"heartbeat", false, DeviceFaultKind::heartbeat_lost, Value::none},
    {"sdo", false, DeviceFaultKind::sdo_silent, Value::none},
    {"power", false, DeviceFaultKind::power_loss, Value::none},
    {"jammed", false, DeviceFaultKind::jammed, Value::none},
    {"exception", false, DeviceFaultKind::modbus_exception, Value::none},
    {"closed", false, DeviceFaultKind::modbus_closed, Value::none},
    {"wrong_unit", false, DeviceFaultKind::modbus_wrong_unit, Value::none},
    {"half_answer", false, DeviceFaultKind::modbus_half, Value::none},
    {"silent", true, DeviceFaultKind::sensor_silent, Value::none},
    {"samples", true, DeviceFaultKind::samples_missing, Value::none},
    {"frozen", true, DeviceFaultKind::frozen, Value::none},
    {"half", true, DeviceFaultKind::half_sample, Value::none},
    {"swapped", true, DeviceFaultKind::swapped, Value::none},
    {"duplicated", true, DeviceFaultKind::duplicated, Value::none},
    {"short", true, DeviceFaultKind::short_frames, Value::none},
    {"checksum", true, DeviceFaultKind::bad_checksum, Value::none},
    {"saturated", true, DeviceFaultKind::saturated, Value::none},
    {"lost", true, DeviceFaultKind::lost, Value::needed},
    {"status", true, DeviceFaultKind::status, Value::needed},
    {"delay", true, DeviceFaultKind::delay, Value::needed},
};

[[noreturn]] void refuse(std::string_view text, std::string expected) {
  throw SetupError({.key = "device fault", .found = description::in_quotes(text), .expected = std::move(expected)});
}

std::string names_for(bool sensor) {
  std::string names;
  for (const KindName& kind : kinds) {
    if (kind.of_sensor == sensor) names += (names.empty() ? "" : ", ") + std::string(kind.name);
  }
  return (sensor ? "for the sensor: " : "for a drive: ") + names;
}

std::uint32_t parse_value(std::string_view all, std::string_view text) {
  const bool hex = text.substr(0, 2) == "0x";
  const std::string_view digits = hex ? text.substr(2) : text;
  std::uint32_t value = 0;
  const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), value, hex ? 16 : 10);
  if (digits.empty() || result.ec != std::errc{} || result.ptr != digits.data() + digits.size()) {
    refuse(all, "after '=' a number from 0 to 4294967295, or 0x...");
  }
  return value;
}

std::int64_t parse_time_ns(std::string_view text) {
  if (text == "0" || text == "0s") return 0;
  return std::llround(description::parse_duration(text, "time of a device fault") * 1e9);
}

}  // namespace

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
  const bool sensor = fault.device == "sensor";
  const KindName* found = nullptr;
  for (const KindName& kind : kinds) {
    if (kind.of_sensor == sensor && what.substr(0, equals) == kind.name) found = &kind;
  }
  if (found == nullptr) refuse(all, names_for(sensor));
  if (has_value != (found->value == Value::needed)) {
    refuse(all, has_value ? "no value for this kind of fault" : "a value, KIND=VALUE");
  }
  fault.kind = found->kind;
  if (has_value) fault.value = parse_value(all, what.substr(equals + 1));
  if (at == std::string_view::npos) return fault;
  if (fault.kind == DeviceFaultKind::device_type) refuse(all, "no time: a device is what it is from the start");
  const std::size_t dots = times.find("..");
  fault.from_ns = parse_time_ns(times.substr(0, dots));
  if (dots != std::string_view::npos) fault.until_ns = parse_time_ns(times.substr(dots + 2));
  if (fault.until_ns <= fault.from_ns) refuse(all, "an end after the beginning");
  return fault;
}

}  // namespace proxarm::sim
