#include "controller/motion/torque_motion.hpp"

#include <cmath>

namespace proxarm::controller {

using models::JointVector;

TorqueMotion::TorqueMotion(std::unique_ptr<TorqueRendering> rendering, const models::Arm& arm,
                           const std::vector<description::DriveDescription>& drives, double period_s)
    : rendering_(std::move(rendering)), max_speed_rad_per_s_(arm.axes()), period_s_(period_s) {
  for (Eigen::Index i = 0; i < max_speed_rad_per_s_.size(); ++i) {
    max_speed_rad_per_s_[i] = drives[static_cast<std::size_t>(i)].max_speed_rad_per_s;
  }
  state_.torque_Nm = JointVector::Zero(arm.axes());
}

// Anchors the device where it stands until its first drive is enabled and its brake opens.
void TorqueMotion::hold(const Measured& measured) noexcept {
  if (measured.following == 0) rendering_->anchor(measured.link_rad);
  state_.torque_Nm = rendering_->hold(measured.link_rad).torque_Nm;
}

void TorqueMotion::start(const Measured& measured, Beginning /*beginning*/) noexcept {
  rendering_->start(measured.link_rad);
}

// A device that a hand drives back must not run away; it may be as fast as its joints may.
bool TorqueMotion::render(const MotionCycle& cycle) noexcept {
  const Measured& measured = cycle.measured;
  for (Eigen::Index i = 0; i < measured.axes(); ++i) {
    const double speed = std::abs(measured.moved_rad[i]) / period_s_;
    if (speed > max_speed_rad_per_s_[i]) {
      cycle.alarm.raise(Fault::target_too_fast, static_cast<std::int32_t>(i), speed, max_speed_rad_per_s_[i]);
      return false;
    }
  }
  const TorqueStep& step = rendering_->step(measured.link_rad);
  if (step.world.fault != ProxyFault::none) {
    cycle.alarm.raise(Fault::proxy_not_finite);
    return false;
  }
  active_.add(step.limits);
  state_.proxy_W = step.world.q_W;
  state_.torque_Nm = step.torque_Nm;
  record_world(step.world, cycle.record);
  return true;
}

}  // namespace proxarm::controller
