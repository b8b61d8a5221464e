#include "controller/plausibility/expected.hpp"

#include <cmath>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {

namespace {

using description::number_text;
using description::rounded_text;

std::string with_unit(const std::string& number, const char* unit) {
  return number + (*unit == '\0' ? "" : " ") + unit;
}

bool is_within(double x, const Expected& expected) { return x >= expected.low && x <= expected.high; }

// Returns "; if it is in mm, write 0.02, if in …".
std::string readings(double value, const Measure& measure, const Expected& expected) {
  std::string text;
  for (const OtherUnit& other : expected.others) {
    if (!is_within(measure.found * std::pow(other.in_key, measure.power), expected)) continue;
    text += text.empty() ? "; if it is in " : ", if in ";
    text += std::string(other.name) + ", write " + rounded_text(value * other.in_key);
  }
  return text;
}

}  // namespace

void judge(const std::string& key, double value, const Measure& measure, const Expected& expected,
           std::vector<std::string>& lines) {
  if (!std::isfinite(measure.found) || is_within(measure.found, expected)) return;
  const std::string range = number_text(expected.low) + " to " + number_text(expected.high);
  lines.push_back(key + ": found " + with_unit(number_text(value), measure.value_unit) + ", " +
                  (measure.says.empty() ? "" : measure.says + ", ") + "expected " +
                  (measure.says.empty() ? range : with_unit(range, expected.unit)) +
                  readings(value, measure, expected));
}

void judge(const std::string& key, double value, const Expected& expected, std::vector<std::string>& lines) {
  judge(key, value, {expected.unit, value, 1.0, ""}, expected, lines);
}

}  // namespace proxarm::controller
