#include "controller/setpoints/joint_guard.hpp"

#include <algorithm>
#include <cmath>

#include "controller/limits/braking.hpp"

namespace proxarm::controller {

using models::JointVector;

namespace {

// A lag below this counts as zero. An angle is rounded to some 1e-16 rad, so an acceleration from three angles is off
// by 1e-9 rad/s² at 1 kHz.
constexpr double lag_tolerance_rad = 1e-13;

}  // namespace

JointGuard::JointGuard(const std::vector<description::DriveDescription>& drives, double period_s)
    : period_s_(period_s) {
  for (const description::DriveDescription& drive : drives) {
    joints_.push_back(
        {drive.range_rad[0], drive.range_rad[1], drive.max_speed_rad_per_s, drive.max_acceleration_rad_per_s2});
  }
  start(JointVector::Zero(static_cast<Eigen::Index>(joints_.size())));
}

void JointGuard::start(const JointVector& target_rad) noexcept {
  target_rad_ = wanted_k1_rad_ = target_rad;
  speed_rad_per_s_ = JointVector::Zero(target_rad.size());
}

void JointGuard::follow_from_here(std::uint8_t but_not) noexcept {
  for (Eigen::Index i = 0; i < target_rad_.size(); ++i) {
    if ((but_not & 1u << i) == 0) wanted_k1_rad_[i] = target_rad_[i];
  }
}

bool JointGuard::lags() const noexcept { return lag_rad().cwiseAbs().maxCoeff() > lag_tolerance_rad; }

ActiveLimits JointGuard::step(const JointVector& wanted_rad) noexcept {
  ActiveLimits active;
  const double T = period_s_;
  for (Eigen::Index i = 0; i < target_rad_.size(); ++i) {
    const Joint& joint = joints_[static_cast<std::size_t>(i)];
    const double wanted = std::isfinite(wanted_rad[i]) ? wanted_rad[i] : target_rad_[i];
    const double theta = target_rad_[i], lag = wanted_k1_rad_[i] - theta;
    double wanted_u = (wanted - theta) / T;
    if (std::abs(lag) > lag_tolerance_rad) {
      wanted_u = (wanted - wanted_k1_rad_[i]) / T +
                 std::copysign(approach_speed(std::abs(lag), joint.acceleration_rad_per_s2, T), lag);
    }
    const double u =
        choose_speed(joint, wanted_u, lag, theta, speed_rad_per_s_[i], active, static_cast<std::uint8_t>(1u << i));
    // A wanted setpoint within all limits passes to the bit.
    target_rad_[i] = u == wanted_u && std::abs(lag) <= lag_tolerance_rad ? wanted : theta + u * T;
    speed_rad_per_s_[i] = u;
    wanted_k1_rad_[i] = wanted;
  }
  return active;
}

double JointGuard::choose_speed(const Joint& joint, double wanted_u, double lag, double theta, double u_k1,
                                ActiveLimits& active, std::uint8_t bit) const noexcept {
  const double T = period_s_, a = joint.acceleration_rad_per_s2;
  double u = wanted_u;
  const auto cap = [&](double low, double high, Limit limit) {
    const double capped = std::clamp(u, low, high);
    if (capped != u) active.set(limit, bit);
    u = capped;
  };
  cap(-joint.speed_rad_per_s, joint.speed_rad_per_s, Limit::joint_speed);
  cap(-approach_speed(theta - joint.lower_rad, a, T), approach_speed(joint.upper_rad - theta, a, T),
      Limit::joint_range);
  // The acceleration comes after the range and has the last word. Acceleration and range conflict by rounding at most.
  cap(u_k1 - a * T, u_k1 + a * T, Limit::joint_acceleration);
  if (std::abs(lag) > lag_tolerance_rad && active.kinds == 0) active.set(Limit::joint_acceleration, bit);
  return u;
}

}  // namespace proxarm::controller
