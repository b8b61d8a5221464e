// How a drive with an incremental encoder remembers that it was homed since power-on.
//
// CiA 402 has no such flag outside of homing mode. A value in 1020h (verify configuration) is lost with the power
// unless it is stored (1010h). So homing ends by writing a number there for this joint and this zero.
#pragma once

#include <cmath>
#include <cstdint>

#include "models/description/cell.hpp"

namespace proxarm::description {

inline constexpr std::uint16_t homed_index = 0x1020;
inline constexpr std::uint8_t homed_subindex = 1;

// The number in 1020h after homing. Never 0, the value after power-on. Precondition: the drive has `homing`.
inline std::uint32_t homed_token(const DriveDescription& drive) noexcept {
  std::uint32_t token = 0x811C9DC5U;  // FNV-1a
  const auto add = [&token](std::uint32_t value) { token = (token ^ value) * 0x01000193U; };
  for (const char letter : drive.joint) add(static_cast<unsigned char>(letter));
  add(static_cast<std::uint32_t>(std::lround(1e6 * drive.homing->angle_rad)));
  return token | 1U;
}

// offset_counts for a drive that counts from its home: its counts at joint angle zero.
inline std::int32_t homed_offset_counts(const DriveDescription& drive) noexcept {
  return static_cast<std::int32_t>(std::lround(-drive.homing->angle_rad * drive.counts_per_rad()));
}

}  // namespace proxarm::description
