#include "controller/motion/torque_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/motion/hand_judge.hpp"

namespace proxarm::controller {

using models::JointVector;
using models::Vec3;

namespace {

// Allowed error of the weight's torque as a share of max_torque_Nm. With models/cells/light.yaml it is 0.36 Nm, 0.7 N
// at the handle. A drive's friction is some tenths of 0.36 Nm.
constexpr double missing_share = 0.02;
// Time constant of the low-pass for τ_0. The held joints settle within 50 ms; the tare takes 0.2 s.
constexpr double missing_filter_s = 0.05;
// Time constant of the low-pass for the tool's velocity. An encoder step of 8 µrad changes the velocity by 7 mm/s at
// 0.9 m and 1 kHz, and by 0.7 mm/s behind the low-pass.
constexpr double speed_filter_s = 0.01;
// Mass that may remain at the handle without a holding hand, such as a limp hand or a strap. While the device brakes,
// the inertial force of this mass doesn't count as a hand's force.
constexpr double left_kg = 0.5;
// Factor on the distances after which the handle counts as empty. The full distances are for a proxy, which coasts by
// its mass. A light device that is let go is slow, and its friction ends the motion.
constexpr double way_share = 0.5;

}  // namespace

TorqueMotion::TorqueMotion(std::unique_ptr<TorqueRendering> rendering, const models::Arm& arm,
                           const std::vector<description::DriveDescription>& drives,
                           const description::SupervisionDescription& supervision, double tool_mass_kg, double period_s)
    : rendering_(std::move(rendering)),
      arm_(arm),
      max_speed_rad_per_s_(arm.axes()),
      max_torque_Nm_(arm.axes()),
      period_s_(period_s) {
  for (Eigen::Index i = 0; i < max_speed_rad_per_s_.size(); ++i) {
    max_speed_rad_per_s_[i] = drives[static_cast<std::size_t>(i)].max_speed_rad_per_s;
    max_torque_Nm_[i] = drives[static_cast<std::size_t>(i)].max_torque_Nm;
  }
  state_.torque_Nm = state_.missing_Nm = JointVector::Zero(arm.axes());
  if (supervision.let_go == description::LetGo::coast) return;
  empty_.emplace(EmptyHandleConfig{.band_N = supervision.empty_handle_N,
                                   .tool_mass_kg = tool_mass_kg + left_kg,
                                   .way_share = way_share,
                                   .at_once = false},
                 period_s);
}

// The joints are held at their angles at the time when the first drive is enabled and opens its brake.
void TorqueMotion::wait_for_drives(const Measured& measured) noexcept {
  if (measured.following == 0) rendering_->anchor(measured.link_rad);
  hold(measured, 1.0);
}

void TorqueMotion::stand(const Measured& measured) noexcept {
  hold(measured, period_s_ / (period_s_ + missing_filter_s));
}

void TorqueMotion::hold(const Measured& measured, double share) noexcept {
  const TorqueStep& step = rendering_->hold(measured.link_rad);
  state_.torque_Nm = step.torque_Nm;
  state_.missing_Nm += share * (step.held_Nm - state_.missing_Nm);
}

std::optional<MissingWeight> TorqueMotion::missing_weight() const noexcept {
  for (Eigen::Index i = 0; i < max_torque_Nm_.size(); ++i) {
    const double limit_Nm = missing_share * max_torque_Nm_[i];
    if (std::abs(state_.missing_Nm[i]) > limit_Nm) {
      return MissingWeight{static_cast<std::int32_t>(i), state_.missing_Nm[i], limit_Nm};
    }
  }
  return {};
}

// Returns the size of the force at the tool that fits the missing torques by least squares, (J Jᵀ)⁻¹ J τ_0. Near a
// singular J the result is smaller.
double TorqueMotion::missing_force_N(const JointVector& link_rad) noexcept {
  constexpr double least_lever_m = 0.01;
  arm_.kinematics(link_rad, kinematics_);
  models::Mat3 A = least_lever_m * least_lever_m * models::Mat3::Identity();
  Vec3 b = Vec3::Zero();
  for (Eigen::Index i = 0; i < state_.missing_Nm.size(); ++i) {
    const Vec3 lever = kinematics_.J_W.col(i).head<3>();
    A += lever * lever.transpose();
    b += state_.missing_Nm[i] * lever;
  }
  return A.ldlt().solve(b).norm();
}

void TorqueMotion::start(const Measured& measured, Beginning /*beginning*/) noexcept {
  rendering_->start(measured.link_rad, state_.missing_Nm);
  state_.missing_N = missing_force_N(measured.link_rad);
  state_.tool_k1_W = measured.tool_W;
  state_.v_W.setZero();
  state_.braked = false;
  if (empty_) empty_->start();
}

// Renders only if no joint exceeds its maximum speed, so that a device that the hand moves can't run away.
bool TorqueMotion::render(const MotionCycle& cycle) noexcept {
  const Measured& measured = cycle.measured;
  for (Eigen::Index i = 0; i < measured.axes(); ++i) {
    const double speed = std::abs(measured.moved_rad[i]) / period_s_;
    if (speed > max_speed_rad_per_s_[i]) {
      cycle.alarm.raise(Fault::target_too_fast, static_cast<std::int32_t>(i), speed, max_speed_rad_per_s_[i]);
      return false;
    }
  }
  const TorqueStep& step = rendering_->step(measured.link_rad, largest_tool_speed(cycle));
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

// Returns the bound of the tool's speed. While nobody holds the handle, this bound falls from the tool's speed to zero;
// otherwise the bound is infinite.
double TorqueMotion::largest_tool_speed(const MotionCycle& cycle) noexcept {
  const Measured& measured = cycle.measured;
  State& s = state_;
  const double share = period_s_ / (period_s_ + speed_filter_s);
  s.v_W += share * ((measured.tool_W - s.tool_k1_W) / period_s_ - s.v_W);
  s.tool_k1_W = measured.tool_W;
  constexpr double unbounded = std::numeric_limits<double>::infinity();
  if (!empty_) return unbounded;
  HandSigns signs = hand_signs(measured.hand_W, measured.bias, s.v_W, 0.0, false);
  signs.unknown_N = s.missing_N;
  const bool empty = empty_->step(signs);
  cycle.record.set(RecordFlag::hands_off, empty);
  const double before_m_per_s = s.braked ? s.braked_m_per_s : s.v_W.norm();
  s.braked = empty;
  s.braked_m_per_s = std::max(0.0, before_m_per_s - EmptyHandle::braking_m_per_s2 * period_s_);
  return empty ? s.braked_m_per_s : unbounded;
}

}  // namespace proxarm::controller
