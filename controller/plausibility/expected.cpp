#include "controller/plausibility/expected.hpp"

#include <cmath>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {

namespace {

using description::number_text;
using description::rounded_text;

std::string with_unit(double value, const char* unit) { return number_text(value) + (*unit == '\0' ? "" : " ") + unit; }

// "; if it is in mm, write 0.02; if in …"
std::string readings(double value, const std::vector<OtherUnit>& others, const auto& is_expected) {
  std::string text;
  for (const OtherUnit& other : others) {
    if (!is_expected(other.in_key)) continue;
    text += text.empty() ? "; if it is in " : ", if in ";
    text += std::string(other.name) + ", write " + rounded_text(value * other.in_key);
  }
  return text;
}

}  // namespace

std::optional<std::string> doubt(const std::string& key, double value, const Expected& expected) {
  const auto within = [&](double x) { return x >= expected.low && x <= expected.high; };
  if (!std::isfinite(value) || within(value)) return std::nullopt;
  return key + ": found " + with_unit(value, expected.unit) + ", expected " + number_text(expected.low) + " to " +
         number_text(expected.high) + readings(value, expected.others, [&](double f) { return within(f * value); });
}

void judge(const std::string& key, double value, const Expected& expected, std::vector<std::string>& lines) {
  if (std::optional<std::string> line = doubt(key, value, expected)) lines.push_back(std::move(*line));
}

void judge_measure(const std::string& key, const Measured& found, double low, double high,
                   std::vector<std::string>& lines) {
  const auto within = [&](double x) { return x >= low && x <= high; };
  if (!std::isfinite(found.measure) || within(found.measure)) return;
  const auto would = [&](double factor) { return within(found.measure * std::pow(factor, found.power)); };
  lines.push_back(key + ": found " + with_unit(found.value, found.unit) + ", " + found.says +
                  readings(found.value, found.others, would));
}

}  // namespace proxarm::controller
