#include "models/base/quantity.hpp"

#include <cmath>
#include <optional>
#include <span>
#include <string>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::description {
namespace {

// A unit: the SI value is number · multiply / divide. Powers of ten are exact in a double, and a division by one of
// them rounds once. So "1ms" equals 1e-3 exactly.
struct Unit {
  std::string_view name;
  double multiply, divide;
};

struct Kind {
  std::string_view what, example;
  std::span<const Unit> units;
  bool needs_unit, allows_zero;
};

constexpr Unit durations[] = {{"s", 1, 1},    {"ms", 1, 1e3}, {"us", 1, 1e6},   {"µs", 1, 1e6},
                              {"μs", 1, 1e6}, {"ns", 1, 1e9}, {"min", 60, 1.0}, {"h", 3600, 1}};
constexpr Unit masses[] = {{"kg", 1, 1}, {"g", 1, 1e3}};
constexpr Unit dampings[] = {{"Ns/m", 1, 1}, {"N*s/m", 1, 1}, {"N·s/m", 1, 1}};
constexpr Unit inertias[] = {{"kgm²", 1, 1}, {"kg m²", 1, 1}, {"kgm2", 1, 1}, {"kg*m^2", 1, 1}};
constexpr Unit turning_dampings[] = {{"Nms/rad", 1, 1}, {"Nms", 1, 1}};
constexpr Unit turning_stiffnesses[] = {{"Nm/rad", 1, 1}, {"Nm", 1, 1}};
constexpr Unit lengths[] = {{"m", 1, 1}, {"mm", 1, 1e3}, {"cm", 1, 1e2}};
constexpr Unit forces[] = {{"N", 1, 1}};
constexpr Unit torques[] = {{"Nm", 1, 1}, {"N*m", 1, 1}};
constexpr Unit angles[] = {{"rad", 1, 1}, {"mrad", 1, 1e3}};
constexpr Unit angular_speeds[] = {{"rad/s", 1, 1}, {"mrad/s", 1, 1e3}};
constexpr Unit force_rates[] = {{"N/s", 1, 1}};
constexpr Unit factors[] = {{"", 1, 1}};
constexpr Unit stiffnesses[] = {{"N/m", 1, 1}, {"N/mm", 1e3, 1}};

std::string expected(const Kind& kind) {
  return std::string(kind.what) + (kind.allows_zero ? ", zero or more" : " above zero") +
         (kind.needs_unit ? ", with its unit" : "") + ", such as " + std::string(kind.example);
}

double parse(std::string_view text, std::string_view option, const Kind& kind) {
  const auto fail = [&](std::string advice = {}) {
    return SetupError({.key = std::string(option),
                       .found = in_quotes(text),
                       .expected = expected(kind),
                       .advice = std::move(advice)});
  };
  std::string_view rest = text;
  while (rest.starts_with(' ')) rest.remove_prefix(1);
  while (rest.ends_with(' ')) rest.remove_suffix(1);
  // Finds the longest beginning of the text that is a number; the rest is the unit. ("1e3s" is 1000 s, because no unit
  // begins with e.)
  std::size_t length = std::min<std::size_t>(rest.size(), 64);
  std::optional<double> number;
  while (length > 0 && !(number = strict_number(rest.substr(0, length)))) --length;
  if (!number) throw fail();
  std::string_view unit = rest.substr(length);
  while (unit.starts_with(' ')) unit.remove_prefix(1);
  if (unit.empty()) {
    if (kind.needs_unit) {
      const std::string written(rest.substr(0, length));
      const bool time = kind.units.front().name == "s";
      throw fail("the unit is missing: " + written + (time ? "ms? " : "mm? ") + written + (time ? "s?" : "m?"));
    }
    unit = kind.units.front().name;
  }
  for (const Unit& u : kind.units) {
    if (u.name != unit) continue;
    const double value = *number * u.multiply / u.divide;
    if (!std::isfinite(value) || value < 0.0 || (!kind.allows_zero && value == 0.0)) throw fail();
    return value;
  }
  std::string names;
  for (const Unit& u : kind.units) names += (names.empty() ? "" : ", ") + std::string(u.name);
  throw fail(in_quotes(unit) + " is no unit of it; known: " + names);
}

}  // namespace

double parse_duration(std::string_view text, std::string_view option) {
  return parse(text, option, {"a duration", "1ms", durations, true, false});
}
double parse_mass(std::string_view text, std::string_view option) {
  return parse(text, option, {"a mass", "3kg", masses, false, false});
}
double parse_damping(std::string_view text, std::string_view option) {
  return parse(text, option, {"a damping", "20Ns/m", dampings, false, true});
}
double parse_stiffness(std::string_view text, std::string_view option) {
  return parse(text, option, {"a stiffness", "500N/m", stiffnesses, false, true});
}
double parse_inertia(std::string_view text, std::string_view option) {
  return parse(text, option, {"a moment of inertia", "0.02kgm²", inertias, false, false});
}
double parse_turning_damping(std::string_view text, std::string_view option) {
  return parse(text, option, {"a damping of turning", "0.5Nms/rad", turning_dampings, false, true});
}
double parse_turning_stiffness(std::string_view text, std::string_view option) {
  return parse(text, option, {"a stiffness of turning", "20Nm/rad", turning_stiffnesses, false, true});
}
double parse_length(std::string_view text, std::string_view option) {
  return parse(text, option, {"a length", "20mm", lengths, true, false});
}
double parse_force(std::string_view text, std::string_view option) {
  return parse(text, option, {"a force", "20N", forces, false, false});
}

double parse_torque(std::string_view text, std::string_view option) {
  return parse(text, option, {"a torque", "100Nm", torques, false, true});
}

double parse_angle(std::string_view text, std::string_view option) {
  return parse(text, option, {"an angle", "5mrad", angles, false, false});
}

double parse_angular_speed(std::string_view text, std::string_view option) {
  return parse(text, option, {"a speed", "0.5rad/s", angular_speeds, false, false});
}

double parse_force_rate(std::string_view text, std::string_view option) {
  return parse(text, option, {"a force per time", "0.5N/s", force_rates, false, false});
}

double parse_factor(std::string_view text, std::string_view option) {
  return parse(text, option, {"a factor", "2", factors, false, false});
}

}  // namespace proxarm::description
