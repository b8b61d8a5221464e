// Computes the interval of angles in which a drive that follows its setpoints must be, for any filter in its control
// loop.
//
// A drive's position is a weighted mean of its setpoints: it latches them at SYNC, interpolates, and its loop lags. Its
// answer is delayed as well. With the setpoint s(k), the period T and the sum τ of all these delays
// (following_lag_s()), the envelope is
//   h(k) = max(s(k), s(k) + (1 − T/τ)(h(k−1) − s(k))),   l(k) the same with min
// Both bounds forget old setpoints with the time constant τ, so that l ≤ θ ≤ h for a drive with a delay of up to τ at
// constant speed. While a drive accelerates at a from rest, a pure delay of τ puts it outside by up to 0.13 aτ²: 0.2
// mrad at 30 rad/s² and 1 ms.
#pragma once

#include <vector>

#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

// τ: 5 T on CAN, plus the drive's own lag. On a Modbus line plus two exchanges, as setpoint and answer each wait for
// one.
[[nodiscard]] double following_lag_s(const description::DriveDescription& drive, double period_s,
                                     double feedback_period_s) noexcept;

// Lag of the slowest position loop: 1/(2π f) for its bandwidth f.
[[nodiscard]] double slowest_drive_lag_s(const std::vector<description::DriveDescription>& drives) noexcept;

class SetpointEnvelope {
 public:
  // Starts at rest at these angles.
  void start(const models::JointVector& setpoint_rad) noexcept { low_rad_ = high_rad_ = setpoint_rad; }
  void start(Eigen::Index joint, double setpoint_rad) noexcept { low_rad_[joint] = high_rad_[joint] = setpoint_rad; }
  // One period of one joint.
  void step(Eigen::Index joint, double setpoint_rad, double period_s, double lag_s) noexcept;

  [[nodiscard]] double low_rad(Eigen::Index joint) const noexcept { return low_rad_[joint]; }
  [[nodiscard]] double high_rad(Eigen::Index joint) const noexcept { return high_rad_[joint]; }
  // Widens the envelope for a drive that from now on brakes by itself.
  void widen(Eigen::Index joint, double down_rad, double up_rad) noexcept;
  // Distance of an angle above the upper bound (positive) or below the lower (negative); 0 between them.
  [[nodiscard]] double outside_rad(Eigen::Index joint, double angle_rad) const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { state(low_rad_, high_rad_); }

 private:
  models::JointVector low_rad_, high_rad_;
};

}  // namespace proxarm::controller
