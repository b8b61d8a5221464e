#include "fieldbus/cia402/cia402_units.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr double int32_low = std::numeric_limits<std::int32_t>::min();
constexpr double int32_high = std::numeric_limits<std::int32_t>::max();

[[noreturn]] void refuse(const description::DriveDescription& drive, const char* key, double found,
                         const char* expected) {
  throw description::SetupError({.bus = drive.bus,
                                 .node = drive.node,
                                 .key = "drive of " + drive.joint + ": " + key,
                                 .found = description::number_text(found),
                                 .expected = expected});
}

}  // namespace

CountScale::CountScale(const description::DriveDescription& drive)
    : counts_per_rad_(drive.direction * drive.counts_per_motor_revolution * drive.gear_ratio /
                      (2.0 * std::numbers::pi)),
      offset_counts_(drive.offset_counts) {
  if (!(drive.counts_per_motor_revolution > 0.0) || !std::isfinite(drive.counts_per_motor_revolution)) {
    refuse(drive, "counts_per_motor_revolution", drive.counts_per_motor_revolution, "a positive number of counts");
  }
  if (!(drive.gear_ratio > 0.0) || !std::isfinite(counts_per_rad_)) {
    refuse(drive, "gear_ratio", drive.gear_ratio, "a positive number of motor revolutions per joint revolution");
  }
  if (drive.direction != 1 && drive.direction != -1) refuse(drive, "direction", drive.direction, "1 or -1");
  for (const double limit_rad : drive.range_rad) {
    if (!counts(limit_rad)) {
      refuse(drive, "range_rad", limit_rad,
             "an angle whose counts fit a 32-bit integer: set the drive's offset nearer");
    }
  }
}

std::optional<std::int32_t> CountScale::counts(double angle_rad) const noexcept {
  const double exact = std::round(angle_rad * counts_per_rad_) + offset_counts_;
  if (!(exact >= int32_low && exact <= int32_high)) return std::nullopt;  // NaN fails both comparisons
  return static_cast<std::int32_t>(exact);
}

double CountScale::angle_rad(std::int32_t counts) const noexcept { return (counts - offset_counts_) / counts_per_rad_; }

std::optional<std::uint32_t> CountScale::size_counts(double size_rad) const noexcept {
  const double exact = std::ceil(size_rad * std::abs(counts_per_rad_));
  if (!(exact >= 0.0 && exact <= std::numeric_limits<std::uint32_t>::max())) return std::nullopt;
  return static_cast<std::uint32_t>(exact);
}

std::optional<InterpolationPeriod> interpolation_period(std::int64_t period_ns) noexcept {
  if (period_ns <= 0) return std::nullopt;
  std::int64_t units = period_ns;
  int exponent = -9;
  while (units % 10 == 0 && exponent < 0) {
    units /= 10;
    ++exponent;
  }
  if (units > 255) return std::nullopt;
  return InterpolationPeriod{static_cast<std::uint8_t>(units), static_cast<std::int8_t>(exponent)};
}

}  // namespace proxarm::fieldbus
