#include "sim/setpoint_interpolator.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::sim {

void SetpointInterpolator::hold(double position_counts, std::int64_t time_ns) noexcept {
  start_ns_ = time_ns;
  period_ns_ = 0;
  start_counts_ = position_counts;
  velocity_ = acceleration_ = 0.0;
}

void SetpointInterpolator::go_to(double target_counts, std::int64_t time_ns, std::int64_t period_ns) noexcept {
  const ServoDemand now = at(time_ns);
  const double T = 1e-9 * static_cast<double>(period_ns);
  start_ns_ = time_ns;
  period_ns_ = period_ns;
  start_counts_ = now.position_counts;
  velocity_ = (target_counts - now.position_counts) / T;
  acceleration_ = (velocity_ - now.velocity_counts_per_s) / T;
}

void SetpointInterpolator::stop(std::int64_t time_ns) noexcept {
  const ServoDemand now = at(time_ns);
  start_ns_ = time_ns;
  period_ns_ = 0;
  start_counts_ = now.position_counts;
  velocity_ = now.velocity_counts_per_s;
  acceleration_ = 0.0;
}

ServoDemand SetpointInterpolator::at(std::int64_t time_ns) const noexcept {
  const std::int64_t elapsed_ns = std::max<std::int64_t>(time_ns - start_ns_, 0);
  const double on_line_s = 1e-9 * static_cast<double>(std::min(elapsed_ns, period_ns_));
  const double p = start_counts_ + velocity_ * on_line_s;
  if (elapsed_ns < period_ns_ || (elapsed_ns == period_ns_ && period_ns_ > 0)) return {p, velocity_, acceleration_};
  const double d = deceleration_;
  if (velocity_ == 0.0 || d <= 0.0) return {p, 0.0, 0.0};
  const double stop_s = std::abs(velocity_) / d;
  const double tau_s = std::min(1e-9 * static_cast<double>(elapsed_ns - period_ns_), stop_s);
  const double sign = velocity_ > 0.0 ? 1.0 : -1.0;
  const double slowed = p + velocity_ * tau_s - 0.5 * sign * d * tau_s * tau_s;
  if (tau_s >= stop_s) return {slowed, 0.0, 0.0};
  return {slowed, velocity_ - sign * d * tau_s, -sign * d};
}

}  // namespace proxarm::sim
