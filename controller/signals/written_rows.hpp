// Writes a row of a table as text (.csv) or as numbers (.bin). Both writers have the same functions, and each column is
// one call. Only for the sources of this folder.
#pragma once

#include <array>
#include <charconv>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "controller/signals/signal_columns.hpp"

namespace proxarm::controller {

template <typename Number>
void append_number(std::string& text, Number value) {
  std::array<char, 32> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end);
}

// Appends nanoseconds as seconds, digit by digit: 1250000 is 0.00125.
inline void append_seconds(std::string& text, std::int64_t ns, std::size_t least_decimals) {
  if (ns < 0) text += '-';
  const std::uint64_t size = ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  append_number(text, size / 1'000'000'000);
  std::string decimals = std::to_string(1'000'000'000 + size % 1'000'000'000).substr(1);
  while (decimals.size() > least_decimals && decimals.back() == '0') decimals.pop_back();
  if (!decimals.empty()) text += "." + decimals;
}

// The flags that are written. `overrun` is left out because it depends on the wall clock, `truth` because the columns
// show it.
inline constexpr std::array written_flags{RecordFlag::sample_held,
                                          RecordFlag::sample_late,
                                          RecordFlag::feedback_missing,
                                          RecordFlag::limit_speed,
                                          RecordFlag::limit_acceleration,
                                          RecordFlag::limit_workspace,
                                          RecordFlag::limit_joint,
                                          RecordFlag::limit_power,
                                          RecordFlag::limit_keep_out,
                                          RecordFlag::limit_joint_speed,
                                          RecordFlag::limit_joint_acceleration,
                                          RecordFlag::limit_singularity,
                                          RecordFlag::limit_following_error,
                                          RecordFlag::limit_joint_torque,
                                          RecordFlag::guard_speed,
                                          RecordFlag::guard_elbow,
                                          RecordFlag::guard_border,
                                          RecordFlag::guard_turning,
                                          RecordFlag::limit_leash,
                                          RecordFlag::limit_orientation,
                                          RecordFlag::oscillation,
                                          RecordFlag::oscillation_lasts,
                                          RecordFlag::timestep,
                                          RecordFlag::ramp_in,
                                          RecordFlag::slowed,
                                          RecordFlag::power_cut,
                                          RecordFlag::unresolved,
                                          RecordFlag::hands_off};

// Writes a row's values as text, separated by commas.
class TextRow {
 public:
  explicit TextRow(std::string& text) : text_(text) {}

  void integer(auto value) { append_number(next(), value); }
  void number(double value) { append_number(next(), value); }
  void seconds(std::int64_t ns) { append_seconds(next(), ns, 0); }
  void word(const char* name, int /*number*/) { next() += name; }
  void empty() { next(); }
  void flags(const CycleRecord& record) {
    next();
    bool first = true;
    for (const RecordFlag flag : written_flags) {
      if (!record.has(flag)) continue;
      if (!first) text_ += '|';
      text_ += flag_name(flag);
      first = false;
    }
  }

 private:
  std::string& next() {
    if (!first_) text_ += ',';
    first_ = false;
    return text_;
  }

  std::string& text_;
  bool first_ = true;
};

class NumberRow {
 public:
  NumberRow(double* first, std::size_t apart) noexcept : at_(first), apart_(apart) {}

  void integer(auto value) noexcept { number(static_cast<double>(value)); }
  void number(double value) noexcept {
    *at_ = value;
    at_ += apart_;
  }
  // Both operands are exact, so the quotient is the double that is nearest to the decimal number.
  void seconds(std::int64_t ns) noexcept { number(static_cast<double>(ns) / 1e9); }
  void word(const char* /*name*/, int value) noexcept { integer(value); }
  void empty() noexcept { number(std::bit_cast<double>(empty_bits)); }
  void flags(const CycleRecord& record) noexcept {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < written_flags.size(); ++i) bits |= (record.has(written_flags[i]) ? 1U : 0U) << i;
    integer(bits);
  }

 private:
  double* at_;
  std::size_t apart_;
};

void put_all(auto& row, const auto& values) {
  for (const double value : values) row.number(value);
}

class Columns {
 public:
  void add(std::string name, std::string unit, std::string frame, std::string meaning,
           SignalColumn::Form form = SignalColumn::Form::number) {
    all.push_back({std::move(name), std::move(unit), std::move(frame), std::move(meaning), form, {}});
  }
  void add_words(std::string name, std::string meaning, SignalColumn::Form form, std::vector<std::string> words) {
    add(std::move(name), "", "", std::move(meaning), form);
    all.back().words = std::move(words);
  }
  // Names the three columns by the vector's name, an axis and the unit: "force_W_x_N".
  void add_vector(const std::string& name, const std::string& unit, const std::string& frame,
                  const std::string& meaning) {
    const std::string shown = unit == "m/s²" ? "m_per_s2" : unit;
    for (const char* axis : {"x", "y", "z"}) add(name + "_" + axis + "_" + shown, unit, frame, meaning + ", " + axis);
  }
  void add_orientation(const std::string& name, const std::string& meaning) {
    for (const char* part : {"x", "y", "z", "w"}) add(name + "_q" + part, "1", "W", meaning + ", quaternion " + part);
  }
  void add_axes(const std::vector<std::string>& names, const std::string& end, const std::string& unit,
                const std::string& meaning, SignalColumn::Form form = SignalColumn::Form::number) {
    for (const std::string& name : names) add(name + end, unit, "", meaning, form);
  }
  std::vector<SignalColumn> all;
};

}  // namespace proxarm::controller
