#include "controller/setpoints/torque_guard.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace proxarm::controller {

using models::JointVector;

namespace {

// Half a period of the gears' fastest swing that the arm's weight takes part in, some 80 Hz.
constexpr double smoothing_s = 0.006;
// Of a drive's torque, what a single setpoint may ask for: friction (3 % in the default cell), the motors' way ahead of
// the links that they bend their gears for, and the hand's pull (200 N at 1.5 m: 12 %) take the rest.
constexpr double strained_share = 0.75;
// Of it, what is left for accelerations at least: an arm that its own weight overloads must still be brought to rest.
constexpr double least_share = 0.1;
// A gear's swing at full stretch takes 0.1 s: after that it has settled or is no more.
constexpr double strain_s = 0.1;
// b/ω of the header is 16 mm/s at the 10 Hz of full stretch: a thirtieth of the default cell's limit.
constexpr double eased_m_per_s2 = 1.0;

}  // namespace

TorqueGuard::TorqueGuard(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                         double max_speed_m_per_s, double period_s)
    : arm_(&arm),
      max_torque_Nm_(JointVector::Constant(arm.axes(), std::numeric_limits<double>::infinity())),
      max_speed_m_per_s_(max_speed_m_per_s) {
  for (Eigen::Index i = 0; i < max_torque_Nm_.size(); ++i) {
    const double most_Nm = drives[static_cast<std::size_t>(i)].max_torque_Nm;
    if (!(most_Nm > 0.0)) continue;
    max_torque_Nm_[i] = most_Nm;
    rated_ = true;
  }
  set_period(period_s);
  start(arm.start_rad());
}

void TorqueGuard::set_period(double period_s) noexcept {
  period_s_ = period_s;
  smoothing_share_ = 1.0 - std::exp(-period_s / smoothing_s);
}

void TorqueGuard::start(const JointVector& link_rad) noexcept {
  relax();
  weigh(link_rad);
}

void TorqueGuard::relax() noexcept {
  state_ = {.smoothed_rad_per_s2 = JointVector::Zero(max_torque_Nm_.size()), .eased_m_per_s = max_speed_m_per_s_};
}

void TorqueGuard::weigh(const JointVector& link_rad) noexcept {
  if (!rated_) return;
  mass_ = arm_->mass_matrix(link_rad);
  gravity_Nm_ = arm_->gravity_torque(link_rad);
}

void TorqueGuard::step() noexcept {
  if (!rated_) return;
  state_.strained_s = std::max(0.0, state_.strained_s - period_s_);
  state_.eased_m_per_s = std::min(max_speed_m_per_s_, state_.eased_m_per_s + eased_m_per_s2 * period_s_);
}

void TorqueGuard::strain() noexcept {
  if (rated_) state_.strained_s = strain_s;
}

void TorqueGuard::ease_from(double speed_m_per_s) noexcept {
  state_.eased_m_per_s = std::min(state_.eased_m_per_s, speed_m_per_s);
}

JointVector TorqueGuard::smoothed(const JointVector& u, const JointVector& u_k1) const noexcept {
  const JointVector& before = state_.smoothed_rad_per_s2;
  return before + smoothing_share_ * ((u - u_k1) / period_s_ - before);
}

void TorqueGuard::judge(const JointVector& u, const JointVector& u_k1, ActiveLimits& out) const noexcept {
  if (!rated_) return;
  const bool strained = state_.strained_s > 0.0;
  const JointVector acceleration = strained ? JointVector((u - u_k1) / period_s_) : smoothed(u, u_k1);
  const JointVector torque_Nm = mass_ * acceleration + gravity_Nm_;
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const double most_Nm = (strained ? strained_share : 1.0) * max_torque_Nm_[i];
    const double weight_Nm = std::abs(gravity_Nm_[i]);
    if (std::abs(torque_Nm[i]) > std::max(most_Nm, weight_Nm + least_share * most_Nm)) {
      out.set(Limit::joint_torque, static_cast<std::uint8_t>(1u << i));
    }
  }
}

double TorqueGuard::stop_s(const JointVector& u) const noexcept {
  if (!(state_.strained_s > 0.0)) return 0.0;
  const JointVector most_Nm = strained_share * max_torque_Nm_;
  const JointVector room_Nm = (most_Nm - gravity_Nm_.cwiseAbs()).cwiseMax(least_share * most_Nm);
  return (mass_ * u).cwiseAbs().cwiseQuotient(room_Nm).maxCoeff();
}

void TorqueGuard::accept(const JointVector& u, const JointVector& u_k1, const JointVector& link_rad) noexcept {
  if (!rated_) return;
  state_.smoothed_rad_per_s2 = smoothed(u, u_k1);
  weigh(link_rad);
}

void TorqueGuard::archive(fieldbus::StateArchive& state, const JointVector& link_rad) noexcept {
  archive_fields(state, state_);
  if (state.reading()) weigh(link_rad);
}

}  // namespace proxarm::controller
