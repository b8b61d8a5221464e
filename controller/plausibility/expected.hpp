// The usual range of a key, and units in which a value outside this range may have been written.
#pragma once

#include <numbers>
#include <string>
#include <vector>

namespace proxarm::controller {

// Another unit that people use for a key. A value in this unit times `in_key` is in the key's own unit.
struct OtherUnit {
  const char* name;
  double in_key;
};

namespace units {
inline constexpr double degree = std::numbers::pi / 180.0, one_g = 9.80665;
inline constexpr OtherUnit mm{"mm", 1e-3}, mm_per_s{"mm/s", 1e-3}, mm_per_s2{"mm/s²", 1e-3},
    m_per_min{"m/min", 1.0 / 60.0}, g{"g", 1e-3}, gravities{"g", one_g}, degrees{"degrees", degree},
    degrees_per_s{"degrees/s", degree}, kHz{"kHz", 1e3}, ms{"ms", 1e-3}, kN{"kN", 1e3}, milli_N{"mN", 1e-3},
    kNm{"kNm", 1e3}, kg_cm2{"kg cm²", 1e-4}, g_m2{"g m²", 1e-3};
}  // namespace units

struct Expected {
  double low, high;
  const char* unit;               // unit of the judged quantity; "": none
  std::vector<OtherUnit> others;  // other units of the value in the file
};

// A quantity that is judged instead of the value, because it is easier to judge than the value. For a stiffness it is
// the resulting frequency: "with which what is behind it swings at 0.4 Hz".
struct Measure {
  const char* value_unit;  // unit of the value in the file
  double found;
  double power;  // found ∝ value^power
  std::string says;
};

// Adds a line to `lines` if the value is out of its range: "limits.leash_m: found 20 m, expected 0.0001 to 0.3; if it
// is in mm, write 0.02". The line names the other units in which the value would be in its range.
void judge(const std::string& key, double value, const Expected& expected, std::vector<std::string>& lines);
// Judges a measure of the value instead of the value; `expected` is the range of the measure.
void judge(const std::string& key, double value, const Measure& measure, const Expected& expected,
           std::vector<std::string>& lines);

}  // namespace proxarm::controller
