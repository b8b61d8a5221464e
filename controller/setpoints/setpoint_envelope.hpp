// Between which angles a drive is that follows its setpoints, whatever filter its loop is.
//
// A drive's position is a mean of the setpoints that it was sent: it latches them at SYNC, interpolates, and its loop
// lags behind them; its answer is as old again. With s(k) the setpoint, T the period and τ the time that all of this
// takes (following_lag_s()):
//   h(k) = max(s(k), s(k) + (1 − T/τ)(h(k−1) − s(k))),   l(k) the same with min
// Both let go of a setpoint that was left with the time constant τ, so that l ≤ θ ≤ h for a drive that is behind by up
// to τ at a constant speed. Where it starts from rest with the acceleration a, one that lags by a pure delay of τ is
// outside by up to 0.13 aτ², 0.2 mrad at 30 rad/s² and 1 ms.
#pragma once

#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

// 5 T on CAN, two exchanges more on Modbus, where a setpoint waits for one and so does the answer, and the drive's own
// lag.
[[nodiscard]] double following_lag_s(const description::DriveDescription& drive, double period_s,
                                     double feedback_period_s) noexcept;

class SetpointEnvelope {
 public:
  // At rest there.
  void start(const models::JointVector& setpoint_rad) noexcept { low_rad_ = high_rad_ = setpoint_rad; }
  void start(Eigen::Index joint, double setpoint_rad) noexcept { low_rad_[joint] = high_rad_[joint] = setpoint_rad; }
  // One period of one joint.
  void step(Eigen::Index joint, double setpoint_rad, double period_s, double lag_s) noexcept;

  [[nodiscard]] double low_rad(Eigen::Index joint) const noexcept { return low_rad_[joint]; }
  [[nodiscard]] double high_rad(Eigen::Index joint) const noexcept { return high_rad_[joint]; }
  // By how much an angle is above the highest, below zero: below the lowest; 0 between them.
  [[nodiscard]] double outside_rad(Eigen::Index joint, double angle_rad) const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { state(low_rad_, high_rad_); }

 private:
  models::JointVector low_rad_, high_rad_;
};

}  // namespace proxarm::controller
