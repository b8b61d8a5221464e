// What a key's value usually is, and what one outside of that may have been meant as.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace proxarm::controller {

// Another unit in which people write this key: value × `in_key` is in the key's own.
struct OtherUnit {
  const char* name;
  double in_key;
};

struct Expected {
  double low, high;  // in `unit`
  const char* unit;  // "" if it has none
  std::vector<OtherUnit> others;
};

// "limits.leash_m: found 20 m, expected 0.0001 to 0.3; if it is in mm, write 0.02". None if `value` is expected. Those
// of the other units are named that lead to what is expected.
std::optional<std::string> doubt(const std::string& key, double value, const Expected& expected);

// Adds it to `lines`, if there is one.
void judge(const std::string& key, double value, const Expected& expected, std::vector<std::string>& lines);

// The same where what is judged isn't the value itself, but `measure` of it, such as a frequency that it leads to;
// `says` tells of that: "with which the arm behind it swings at 0.4 Hz". `expected` is in the measure's unit.
struct Measured {
  double value;                   // as the file has it
  const char* unit;               // its own
  double measure;                 // what it leads to
  double power;                   // measure ∝ value^power
  std::string says;               // of the measure
  std::vector<OtherUnit> others;  // of the value
};
void judge_measure(const std::string& key, const Measured& found, double low, double high,
                   std::vector<std::string>& lines);

}  // namespace proxarm::controller
