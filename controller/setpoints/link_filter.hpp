// Filters the wanted link angles q to the commanded link angles q_f, critically damped (elastic_setpoint.hpp):
//
//   q̈_f = ω²(q − q_f) − 2ω q̇_f
// The solution is exact for an input q that is constant over the period. With ω = 0 there is no filter: q_f = q.
// Nothing allocates, locks or throws.
#pragma once

#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

class LinkFilter {
 public:
  LinkFilter(double bandwidth_Hz, double period_s) noexcept;

  void set_period(double period_s) noexcept;
  // Continues from these angles and speeds; discards the filter's state.
  void resume(const models::JointVector& rad, const models::JointVector& rad_per_s) noexcept;
  void start(const models::JointVector& rad) noexcept { resume(rad, models::JointVector::Zero(rad.size())); }
  // Filters wanted_rad for one period. Returns the acceleration q̈_f at the end of the period, rad/s².
  models::JointVector step(const models::JointVector& wanted_rad) noexcept;

  [[nodiscard]] bool filters() const noexcept { return omega_rad_per_s_ > 0.0; }
  [[nodiscard]] const models::JointVector& rad() const noexcept { return rad_; }
  [[nodiscard]] const models::JointVector& rad_per_s() const noexcept { return rad_per_s_; }
  // Lead of the filter's input over its output at constant speed: 2/ω in seconds; 0 without a filter.
  [[nodiscard]] double lead_s() const noexcept { return filters() ? 2.0 / omega_rad_per_s_ : 0.0; }
  // The input for which the output keeps its speed over the next period.
  [[nodiscard]] models::JointVector coasting_rad() const noexcept;
  // Distance of another input from coasting_rad(), divided by the output's mean acceleration that this input causes.
  [[nodiscard]] double input_s2() const noexcept {
    return filters() ? 1.0 / (decay_ * omega_rad_per_s_ * omega_rad_per_s_) : period_s_ * period_s_;
  }
  void archive(fieldbus::StateArchive& state) noexcept { state(rad_, rad_per_s_); }

 private:
  double omega_rad_per_s_;
  double decay_ = 1.0;  // exp(−ωT)
  double period_s_ = 0.0;
  models::JointVector rad_, rad_per_s_;
};

}  // namespace proxarm::controller
