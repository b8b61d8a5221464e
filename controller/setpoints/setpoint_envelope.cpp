#include "controller/setpoints/setpoint_envelope.hpp"

#include <algorithm>
#include <numbers>

namespace proxarm::controller {

double following_lag_s(const description::DriveDescription& drive, double period_s, double feedback_period_s) noexcept {
  return 5.0 * period_s + 2.0 * feedback_period_s + 1.0 / (2.0 * std::numbers::pi * drive.position_bandwidth_Hz);
}

double slowest_drive_lag_s(const std::vector<description::DriveDescription>& drives) noexcept {
  double slowest_s = 0.0;
  for (const description::DriveDescription& drive : drives) {
    slowest_s = std::max(slowest_s, 1.0 / (2.0 * std::numbers::pi * drive.position_bandwidth_Hz));
  }
  return slowest_s;
}

void SetpointEnvelope::step(Eigen::Index joint, double setpoint_rad, double period_s, double lag_s) noexcept {
  const double s = setpoint_rad, kept = 1.0 - period_s / lag_s;
  double &low = low_rad_[joint], &high = high_rad_[joint];
  low = std::min(s, s + kept * (low - s));
  high = std::max(s, s + kept * (high - s));
}

void SetpointEnvelope::widen(Eigen::Index joint, double down_rad, double up_rad) noexcept {
  low_rad_[joint] -= down_rad;
  high_rad_[joint] += up_rad;
}

double SetpointEnvelope::outside_rad(Eigen::Index joint, double angle_rad) const noexcept {
  return angle_rad - std::clamp(angle_rad, low_rad_[joint], high_rad_[joint]);
}

}  // namespace proxarm::controller
