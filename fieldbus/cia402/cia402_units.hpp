// Converts joint angles in radians to a drive's counts, and a period to the objects that hold it.
//
//   counts = offset_counts + round(q · direction · counts_per_motor_revolution · gear_ratio / 2π)
//
// Rounded to the nearest count, halves away from zero: a round trip is off by at most half a count. Counts are int32;
// for an angle out of their range there are no counts: it neither wraps nor saturates.
#pragma once

#include <cstdint>
#include <optional>

#include "models/description/cell.hpp"

namespace proxarm::fieldbus {

class CountScale {
 public:
  // Throws SetupError if a value is unusable, or if the joint's range doesn't fit int32.
  explicit CountScale(const description::DriveDescription& drive);

  [[nodiscard]] std::optional<std::int32_t> counts(double angle_rad) const noexcept;  // nullopt: NaN or out of range
  [[nodiscard]] double angle_rad(std::int32_t counts) const noexcept;
  [[nodiscard]] double counts_per_rad() const noexcept { return counts_per_rad_; }  // signed like `direction`
  // A size (window, speed) in counts, rounded up; nullopt if negative, not finite or too large.
  [[nodiscard]] std::optional<std::uint32_t> size_counts(double size_rad) const noexcept;

 private:
  double counts_per_rad_;
  double offset_counts_;
};

// 60C2h: period = units · 10^exponent s, units 1..255.
struct InterpolationPeriod {
  std::uint8_t units = 1;
  std::int8_t exponent = -3;
  friend bool operator==(const InterpolationPeriod&, const InterpolationPeriod&) = default;
};

// The one with the fewest units that is exactly `period_ns`; nullopt if there is none.
[[nodiscard]] std::optional<InterpolationPeriod> interpolation_period(std::int64_t period_ns) noexcept;

}  // namespace proxarm::fieldbus
