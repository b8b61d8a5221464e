// How fast something may be that has to brake.
#pragma once

#include <cmath>

namespace proxarm::controller {

// The fastest approach from which braking at `a` ends within `distance`, with setpoints every T: −aT + √(a²T² + 2a d).
// 0 if the end has been passed already.
[[nodiscard]] inline double approach_speed(double distance, double a, double T) noexcept {
  if (!(distance > 0.0)) return 0.0;
  return 2.0 * distance / (T + std::sqrt(T * T + 2.0 * distance / a));
}

// The highest speed of a point on the way to rest, while all joints brake together along their motion: V is its speed
// at the start, B = t |u|ᵀC|u| (setpoints/tool_guard.hpp has the derivation).
[[nodiscard]] inline double fastest_to_rest(double V, double B) noexcept {
  return B <= V ? V : (V + B) * (V + B) / (4.0 * B);
}

}  // namespace proxarm::controller
