// The last word on what drives are told: no setpoint beyond its joint's range, speed or acceleration, ever, whatever is
// wanted.
//
// Per joint, with θ₁ and u₁ the last setpoint and its speed, T the period, a and v the joint's limits:
//   |u − u₁| ≤ aT,   |u| ≤ v,   u ≤ c(θ_max − θ₁),   −u ≤ c(θ₁ − θ_min),   θ = θ₁ + uT
//   c(d) = −aT + √(a²T² + 2ad): the fastest approach from which braking at a ends within d
// These never contradict each other: with Tu + u²/(2a) ≤ d, braking (u' = u − aT) keeps Tu' + u'²/(2a) ≤ d − Tu.
//
// What is wanted passes unchanged where it may. Where it may not, the setpoint lags, and catches up along the
// time-optimal course: the speed of what is wanted, plus c(lag) towards it. Neither allocates, locks nor throws.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/step_limits.hpp"
#include "fieldbus/state_archive.hpp"
#include "models/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class JointGuard {
 public:
  JointGuard(const std::vector<description::DriveDescription>& drives, double period_s);

  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // At rest there.
  void start(const models::JointVector& target_rad) noexcept;
  // One period; what isn't finite is taken as the last setpoint. Returns which limits held something back.
  ActiveLimits step(const models::JointVector& wanted_rad) noexcept;
  // Forgets what was wanted so far: no lag is left to catch up. Not of the joints in `but_not`, as bits: those are on
  // their way to somewhere, and brake ahead of it.
  void follow_from_here(std::uint8_t but_not = 0) noexcept;

  [[nodiscard]] const models::JointVector& target_rad() const noexcept { return target_rad_; }
  [[nodiscard]] const models::JointVector& speed_rad_per_s() const noexcept { return speed_rad_per_s_; }
  // How far the setpoints are behind what was wanted: of the joint that is furthest.
  [[nodiscard]] double lag_rad() const noexcept { return (wanted_k1_rad_ - target_rad_).cwiseAbs().maxCoeff(); }
  [[nodiscard]] bool at_rest() const noexcept { return speed_rad_per_s_.cwiseAbs().maxCoeff() < 1e-9; }
  void archive(fieldbus::StateArchive& state) noexcept { state(target_rad_, speed_rad_per_s_, wanted_k1_rad_); }

 private:
  struct Joint {
    double lower_rad, upper_rad, speed_rad_per_s, acceleration_rad_per_s2;
  };
  double choose_speed(const Joint& joint, double wanted_u, double lag, double theta, double u_k1, ActiveLimits& active,
                      std::uint8_t bit) const noexcept;

  std::vector<Joint> joints_;
  double period_s_;
  models::JointVector target_rad_, speed_rad_per_s_, wanted_k1_rad_;
};

}  // namespace proxarm::controller
