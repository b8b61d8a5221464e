// Converts joint angles in radians to a drive's counts, and a period to the objects that hold it.
//
//   counts = offset_counts + round(q · direction · counts_per_motor_revolution · gear_ratio / 2π)
//
// Counts are rounded to the nearest integer, halves away from zero, so an angle that is converted to counts and back is
// off by at most half a count. Counts are int32. An angle whose counts don't fit int32 gives nullopt; it neither wraps
// nor saturates.
#pragma once

#include <cstdint>
#include <optional>

#include "models/description/cell.hpp"

namespace proxarm::fieldbus {

class CountScale {
 public:
  // Throws SetupError if a value of the description is invalid, or if the counts of the joint's range don't fit int32.
  explicit CountScale(const description::DriveDescription& drive);

  // nullopt: the angle is NaN or its counts don't fit int32.
  [[nodiscard]] std::optional<std::int32_t> counts(double angle_rad) const noexcept;
  [[nodiscard]] double angle_rad(std::int32_t counts) const noexcept;
  // Has the sign of `direction`.
  [[nodiscard]] double counts_per_rad() const noexcept { return counts_per_rad_; }
  // Converts a size (a window or a speed) to counts, rounded up. Returns nullopt if the size is negative or not finite,
  // or if its counts are too large.
  [[nodiscard]] std::optional<std::uint32_t> size_counts(double size_rad) const noexcept;

 private:
  double counts_per_rad_;
  double offset_counts_;
};

// The contents of 60C2h: period = units · 10^exponent s, with units 1..255.
struct InterpolationPeriod {
  std::uint8_t units = 1;
  std::int8_t exponent = -3;
  friend bool operator==(const InterpolationPeriod&, const InterpolationPeriod&) = default;
};

// Returns the representation of exactly `period_ns` that has the fewest units; nullopt if the period has no such
// representation.
[[nodiscard]] std::optional<InterpolationPeriod> interpolation_period(std::int64_t period_ns) noexcept;

}  // namespace proxarm::fieldbus
