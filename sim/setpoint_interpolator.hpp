// From one target per SYNC to a demand at every tick of the servo loop, and to a bounded stop when no target comes.
//
// A target latched at SYNC k, t₀ = t(SYNC k), is reached one interpolation period T later, on a straight line from where
// the demand is:
//   p(t) = p₀ + v (t − t₀),  v = (target − p₀)/T                       t₀ ≤ t ≤ t₀ + T
// Past t₀ + T with no new target the demand runs on and slows down at the bounded deceleration d, never with a jump:
//   p(t) = p₀ + v T + v τ − ½ sgn(v) d τ²,  τ = min(t − t₀ − T, |v|/d)
// A stop is the same with T = 0.
#pragma once

#include <cstdint>

#include "sim/servo_axis.hpp"

namespace proxarm::sim {

class SetpointInterpolator {
 public:
  // Stands still at a position from now on.
  void hold(double position_counts, std::int64_t time_ns) noexcept;
  // Towards a target, to be there at time_ns + period_ns (> 0).
  void go_to(double target_counts, std::int64_t time_ns, std::int64_t period_ns) noexcept;
  // Slows down from the present velocity, at the deceleration set below.
  void stop(std::int64_t time_ns) noexcept;
  // d, in counts/s²; 0 or less stops at once.
  void set_deceleration(double counts_per_s2) noexcept { deceleration_ = counts_per_s2; }

  [[nodiscard]] ServoDemand at(std::int64_t time_ns) const noexcept;
  [[nodiscard]] bool at_rest(std::int64_t time_ns) const noexcept { return at(time_ns).velocity_counts_per_s == 0.0; }

 private:
  std::int64_t start_ns_ = 0;
  std::int64_t period_ns_ = 0;
  double start_counts_ = 0.0;
  double velocity_ = 0.0;      // counts/s, along the line
  double acceleration_ = 0.0;  // counts/s², from the line before to this one
  double deceleration_ = 0.0;
};

}  // namespace proxarm::sim
