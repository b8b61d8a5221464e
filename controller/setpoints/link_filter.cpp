#include "controller/setpoints/link_filter.hpp"

#include <cmath>
#include <numbers>

namespace proxarm::controller {

using models::JointVector;

LinkFilter::LinkFilter(double bandwidth_Hz, double period_s) noexcept
    : omega_rad_per_s_(2.0 * std::numbers::pi * bandwidth_Hz) {
  set_period(period_s);
}

void LinkFilter::set_period(double period_s) noexcept {
  period_s_ = period_s;
  decay_ = std::exp(-omega_rad_per_s_ * period_s);
}

void LinkFilter::resume(const JointVector& rad, const JointVector& rad_per_s) noexcept {
  rad_ = rad;
  rad_per_s_ = rad_per_s;
}

// Solves the filter's equation with e = q_f − q and q constant over the period:
//   e(T) = (e + (ė + ωe)T) exp(−ωT),   ė(T) = (ė − ω(ė + ωe)T) exp(−ωT)
JointVector LinkFilter::step(const JointVector& wanted_rad) noexcept {
  if (!filters()) {
    rad_per_s_ = (wanted_rad - rad_) / period_s_;
    rad_ = wanted_rad;
    return JointVector::Zero(wanted_rad.size());
  }
  const double omega = omega_rad_per_s_, T = period_s_;
  const JointVector e = rad_ - wanted_rad;
  const JointVector c = rad_per_s_ + omega * e;
  rad_ = wanted_rad + decay_ * (e + T * c);
  rad_per_s_ = decay_ * (rad_per_s_ - omega * T * c);
  return omega * omega * (wanted_rad - rad_) - 2.0 * omega * rad_per_s_;
}

// For the input q_f + d and the speed v of the output, c of step() is v − ωd. From ė(T) of step(), the output's mean
// acceleration (ė(T) − v)/T is a if
//   d = (v (exp(ωT) − 1 + ωT) + aT exp(ωT)) / (ω²T)
// coasting_rad() has a = 0; input_s2() is the factor of a.
JointVector LinkFilter::coasting_rad() const noexcept {
  if (!filters()) return rad_ + period_s_ * rad_per_s_;
  const double omega = omega_rad_per_s_, T = period_s_;
  return rad_ + (1.0 / decay_ - 1.0 + omega * T) / (omega * omega * T) * rad_per_s_;
}

}  // namespace proxarm::controller
