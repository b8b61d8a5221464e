// Computes the highest speeds from which a point can brake in time.
#pragma once

#include <cmath>

namespace proxarm::controller {

// Returns the highest speed towards a border from which braking at `a` ends within `distance` d, with setpoints every
// T: −aT + √(a²T² + 2a d). Returns 0 if the point is beyond the border.
[[nodiscard]] inline double approach_speed(double distance, double a, double T) noexcept {
  if (!(distance > 0.0)) return 0.0;
  return 2.0 * distance / (T + std::sqrt(T * T + 2.0 * distance / a));
}

// Returns the highest speed that a point reaches on its way to rest while all joints brake together along their motion.
// V: the point's speed when braking begins; B = t |u|ᵀC|u|, derived in setpoints/tool_guard.hpp.
[[nodiscard]] inline double fastest_to_rest(double V, double B) noexcept {
  return B <= V ? V : (V + B) * (V + B) / (4.0 * B);
}

}  // namespace proxarm::controller
