// Defines how a drive with an incremental encoder remembers that it was homed since power-on.
//
// CiA 402 has no flag for this outside homing mode. A value in 1020h (verify configuration) is lost at power-off,
// unless the drive stores it (1010h). So homing ends by writing a number to 1020h. The number depends on the joint and
// its zero.
#pragma once

#include <cmath>
#include <cstdint>

#include "models/description/cell.hpp"

namespace proxarm::description {

inline constexpr std::uint16_t homed_index = 0x1020;
inline constexpr std::uint8_t homed_subindex = 1;

// Returns the number that 1020h has after homing. It is never 0, which 1020h has after power-on. Precondition: the
// drive has `homing`.
inline std::uint32_t homed_token(const DriveDescription& drive) noexcept {
  std::uint32_t token = 0x811C9DC5U;  // FNV-1a
  const auto add = [&token](std::uint32_t value) { token = (token ^ value) * 0x01000193U; };
  for (const char letter : drive.joint) add(static_cast<unsigned char>(letter));
  add(static_cast<std::uint32_t>(std::lround(1e6 * drive.homing->angle_rad)));
  return token | 1U;
}

// Returns offset_counts for a drive that counts from its home: the counts at joint angle zero.
inline std::int32_t homed_offset_counts(const DriveDescription& drive) noexcept {
  return static_cast<std::int32_t>(std::lround(-drive.homing->angle_rad * drive.counts_per_rad()));
}

}  // namespace proxarm::description
