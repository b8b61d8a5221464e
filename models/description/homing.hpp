// How a drive with an incremental encoder remembers that it was homed since its power came on.
//
// CiA 402 has nothing that says so outside of its homing mode. What is written to 1020h (verify configuration) goes
// with the power unless somebody stores it (1010h), so homing ends with a number there: of this joint and this zero.
#pragma once

#include <cmath>
#include <cstdint>

#include "models/description/cell.hpp"

namespace proxarm::description {

inline constexpr std::uint16_t homed_index = 0x1020;
inline constexpr std::uint8_t homed_subindex = 1;

// Precondition: it has `homing`. Never 0, which 1020h holds after power on.
inline std::uint32_t homed_token(const DriveDescription& drive) noexcept {
  std::uint32_t token = 0x811C9DC5U;  // FNV-1a
  const auto add = [&token](std::uint32_t value) { token = (token ^ value) * 0x01000193U; };
  for (const char letter : drive.joint) add(static_cast<unsigned char>(letter));
  add(static_cast<std::uint32_t>(std::lround(1e6 * drive.homing->angle_rad)));
  return token | 1U;
}

// The counts of the joint's angle zero where the drive counts from its home: what offset_counts must be.
inline std::int32_t homed_offset_counts(const DriveDescription& drive) noexcept {
  return static_cast<std::int32_t>(std::lround(-drive.homing->angle_rad * drive.counts_per_rad()));
}

}  // namespace proxarm::description
