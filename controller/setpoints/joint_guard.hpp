// Keeps each setpoint within its joint's range, speed and acceleration. The tool guard (tool_guard.hpp) comes after
// this guard, keeps the bounds of the joints as well, and has the last word.
//
// Bounds of a joint's setpoint θ and speed u, where θ₁ and u₁ are the last setpoint and speed, T is the period, and a
// and v are the joint's limits:
//   |u − u₁| ≤ aT,   |u| ≤ v,   u ≤ c(θ_max − θ₁),   −u ≤ c(θ₁ − θ_min),   θ = θ₁ + uT
//   c(d) = −aT + √(a²T² + 2ad): highest speed from which braking at a ends within the distance d (limits/braking.hpp)
// These bounds never conflict. Let d be the distance from an end of the range, and u ≤ c(d), that is Tu + u²/(2a) ≤ d.
// Then the braking speed u' = u − aT satisfies Tu' + u'²/(2a) ≤ d − Tu, the bound of the next period.
//
// A wanted setpoint within all bounds passes unchanged. Otherwise the setpoint lags behind the wanted setpoint, and
// catches up in minimum time: its speed is the wanted setpoint's speed plus c(lag) towards the wanted setpoint. Nothing
// allocates, locks or throws.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class JointGuard {
 public:
  JointGuard(const std::vector<description::DriveDescription>& drives, double period_s);

  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // Starts at rest at these angles.
  void start(const models::JointVector& target_rad) noexcept;
  // Makes the setpoints of one period. An angle that isn't finite is replaced by the last setpoint. Returns the active
  // limits.
  ActiveLimits step(const models::JointVector& wanted_rad) noexcept;
  // Takes over this period's setpoints from another guard. Precondition: these setpoints keep each joint's speed and
  // acceleration.
  void settle(const models::JointVector& target_rad, const models::JointVector& speed_rad_per_s) noexcept {
    target_rad_ = target_rad;
    speed_rad_per_s_ = speed_rad_per_s;
  }
  // Drops the lag: setpoints continue from their present angles. The joints in `but_not` (bits) keep their wanted
  // setpoint as a target; they move to it and brake before it.
  void follow_from_here(std::uint8_t but_not = 0) noexcept;

  [[nodiscard]] const models::JointVector& target_rad() const noexcept { return target_rad_; }
  [[nodiscard]] const models::JointVector& speed_rad_per_s() const noexcept { return speed_rad_per_s_; }
  // Each wanted setpoint less the setpoint.
  [[nodiscard]] models::JointVector lag_rad() const noexcept { return wanted_k1_rad_ - target_rad_; }
  // Whether a joint's limits hold its setpoint back.
  [[nodiscard]] bool lags() const noexcept;
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
