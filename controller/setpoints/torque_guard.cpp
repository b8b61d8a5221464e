#include "controller/setpoints/torque_guard.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/setpoints/torque_share.hpp"

namespace proxarm::controller {

using models::JointVector;

namespace {

// The least part of strained_share that is left for acceleration: an arm that its own weight overloads must still be
// stopped.
constexpr double least_share = 0.1;
// A gear's oscillation at full stretch has a period of 0.1 s; after that it has decayed.
constexpr double strain_s = 0.1;
// The overshoot b/ω of the header is 16 mm/s at the 10 Hz of full stretch: a thirtieth of the default cell's limit.
constexpr double eased_m_per_s2 = 1.0;

}  // namespace

TorqueGuard::TorqueGuard(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                         double max_speed_m_per_s, double period_s)
    : arm_(&arm),
      max_torque_Nm_(JointVector::Constant(arm.axes(), std::numeric_limits<double>::infinity())),
      max_speed_m_per_s_(max_speed_m_per_s),
      period_s_(period_s) {
  for (Eigen::Index i = 0; i < max_torque_Nm_.size(); ++i) {
    const double most_Nm = drives[static_cast<std::size_t>(i)].max_torque_Nm;
    if (!(most_Nm > 0.0)) continue;
    max_torque_Nm_[i] = most_Nm;
    rated_ = true;
  }
  start(arm.start_rad());
}

void TorqueGuard::start(const JointVector& link_rad) noexcept {
  link_rad_ = link_rad;
  relax();
}

void TorqueGuard::relax() noexcept { state_ = {.strained_s = 0.0, .eased_m_per_s = max_speed_m_per_s_}; }

void TorqueGuard::weigh() noexcept {
  mass_ = arm_->mass_matrix(link_rad_);
  gravity_Nm_ = arm_->gravity_torque(link_rad_);
}

void TorqueGuard::step() noexcept {
  if (!rated_) return;
  state_.strained_s = std::max(0.0, state_.strained_s - period_s_);
  state_.eased_m_per_s = std::min(max_speed_m_per_s_, state_.eased_m_per_s + eased_m_per_s2 * period_s_);
}

void TorqueGuard::strain() noexcept {
  if (!rated_) return;
  if (!strained()) weigh();
  state_.strained_s = strain_s;
}

void TorqueGuard::ease_from(double speed_m_per_s) noexcept {
  state_.eased_m_per_s = std::min(state_.eased_m_per_s, speed_m_per_s);
}

void TorqueGuard::judge(const JointVector& u, const JointVector& u_k1, ActiveLimits& out) const noexcept {
  if (!strained()) return;
  const JointVector torque_Nm = mass_ * (u - u_k1) / period_s_ + gravity_Nm_;
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const double most_Nm = strained_share * max_torque_Nm_[i], weight_Nm = std::abs(gravity_Nm_[i]);
    if (std::abs(torque_Nm[i]) > std::max(most_Nm, weight_Nm + least_share * most_Nm)) {
      out.set(Limit::joint_torque, static_cast<std::uint8_t>(1u << i));
    }
  }
}

double TorqueGuard::stop_s(const JointVector& u) const noexcept {
  if (!strained()) return 0.0;
  const JointVector most_Nm = strained_share * max_torque_Nm_;
  const JointVector room_Nm = (most_Nm - gravity_Nm_.cwiseAbs()).cwiseMax(least_share * most_Nm);
  return (mass_ * u).cwiseAbs().cwiseQuotient(room_Nm).maxCoeff();
}

void TorqueGuard::accept(const JointVector& link_rad) noexcept {
  link_rad_ = link_rad;
  if (strained()) weigh();
}

void TorqueGuard::archive(fieldbus::StateArchive& state, const JointVector& link_rad) noexcept {
  archive_fields(state, state_);
  if (!state.reading()) return;
  link_rad_ = link_rad;
  if (strained()) weigh();
}

}  // namespace proxarm::controller
