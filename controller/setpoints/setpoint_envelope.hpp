// Computes the interval of angles in which a drive that follows its setpoints must be, for any filter in its control
// loop.
//
// A drive's position is a weighted mean of its setpoints: the drive latches setpoints at SYNC and interpolates, and its
// control loop lags. The drive's answer is delayed as well. s(k): the setpoint. T: the period. τ: the sum of all these
// delays (following_lag_s()). The envelope is
//   h(k) = max(s(k), s(k) + (1 − T/τ)(h(k−1) − s(k))),   l(k) = min(s(k), s(k) + (1 − T/τ)(l(k−1) − s(k)))
// Both bounds forget old setpoints with the time constant τ. So l ≤ θ ≤ h for the angle θ of a drive that moves at
// constant speed with a delay of at most τ. While a drive accelerates at a from rest, a pure delay of τ puts θ outside
// the envelope by up to 0.13 aτ²: 0.2 mrad at 30 rad/s² and 1 ms.
#pragma once

#include <vector>

#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

// Returns τ: 5 T plus the lag of the drive's control loop. On a Modbus line, two exchanges are added, since setpoint
// and answer each wait for an exchange.
[[nodiscard]] double following_lag_s(const description::DriveDescription& drive, double period_s,
                                     double feedback_period_s) noexcept;

// Returns the lag of the slowest drive's position loop: 1/(2π f) for the bandwidth f of the loop.
[[nodiscard]] double slowest_drive_lag_s(const std::vector<description::DriveDescription>& drives) noexcept;

class SetpointEnvelope {
 public:
  // Starts at rest at these angles.
  void start(const models::JointVector& setpoint_rad) noexcept { low_rad_ = high_rad_ = setpoint_rad; }
  void start(Eigen::Index joint, double setpoint_rad) noexcept { low_rad_[joint] = high_rad_[joint] = setpoint_rad; }
  // Updates the envelope of one joint for one period.
  void step(Eigen::Index joint, double setpoint_rad, double period_s, double lag_s) noexcept;

  [[nodiscard]] double low_rad(Eigen::Index joint) const noexcept { return low_rad_[joint]; }
  [[nodiscard]] double high_rad(Eigen::Index joint) const noexcept { return high_rad_[joint]; }
  // Widens the envelope of a joint whose drive brakes by itself from now on.
  void widen(Eigen::Index joint, double down_rad, double up_rad) noexcept;
  // Returns the distance of an angle above the upper bound (positive) or below the lower bound (negative); 0 between
  // the bounds.
  [[nodiscard]] double outside_rad(Eigen::Index joint, double angle_rad) const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { state(low_rad_, high_rad_); }

 private:
  models::JointVector low_rad_, high_rad_;
};

}  // namespace proxarm::controller
