// Highest speeds from which a point can still brake in time.
#pragma once

#include <cmath>

namespace proxarm::controller {

// Highest approach speed from which braking at `a` ends within `distance`, with setpoints every T: −aT + √(a²T² + 2a
// d). Returns 0 beyond the border.
[[nodiscard]] inline double approach_speed(double distance, double a, double T) noexcept {
  if (!(distance > 0.0)) return 0.0;
  return 2.0 * distance / (T + std::sqrt(T * T + 2.0 * distance / a));
}

// Highest speed of a point on its way to rest while all joints brake together along their motion. V: speed at the
// start; B = t |u|ᵀC|u|, derived in setpoints/tool_guard.hpp.
[[nodiscard]] inline double fastest_to_rest(double V, double B) noexcept {
  return B <= V ? V : (V + B) * (V + B) / (4.0 * B);
}

}  // namespace proxarm::controller
