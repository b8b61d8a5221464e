#include "controller/setpoints/gear_damping.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "controller/setpoints/setpoint_envelope.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

using models::JointVector;

double gear_torque_lag_periods(double drive_lag_s, double reading_delay_s, double period_s) noexcept {
  constexpr double until_reached = 1.5, most = 100.0;
  return std::min(most, until_reached + (drive_lag_s + reading_delay_s) / period_s);
}

double gear_torque_delay_s(const std::vector<description::DriveDescription>& drives) noexcept {
  double oldest_s = 0.0;
  for (const description::DriveDescription& drive : drives) {
    if (drive.gear_torque) oldest_s = std::max(oldest_s, drive.gear_torque->delay_s);
  }
  return oldest_s;
}

std::uint8_t damped_joints(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                           double period_s) {
  const double quarter_s =
      period_s * gear_torque_lag_periods(slowest_drive_lag_s(drives), gear_torque_delay_s(drives), period_s);
  const Eigen::VectorXd mass = arm.link_mass_matrix(arm.start_rad()).diagonal();
  unsigned joints = 0;
  for (Eigen::Index i = 0; i < arm.axes(); ++i) {
    const double omega = std::sqrt(arm.gear_stiffness_Nm_per_rad()[i] / mass[i]);
    const bool slow = omega * quarter_s < 0.5 * std::numbers::pi;
    if (drives[static_cast<std::size_t>(i)].gear_torque && slow) joints |= 1u << i;
  }
  return static_cast<std::uint8_t>(joints);
}

GearDamping::GearDamping(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                         const GearDampingChoice& choice, double period_s)
    : yield_rad_per_Nms_(JointVector::Zero(arm.axes())),
      drive_lag_s_(slowest_drive_lag_s(drives)),
      reading_delay_s_(gear_torque_delay_s(drives)) {
  for (Eigen::Index i = 0; i < arm.axes(); ++i) {
    if ((choice.joints & 1u << i) == 0) continue;
    yield_rad_per_Nms_[i] = choice.damping_per_s / arm.gear_stiffness_Nm_per_rad()[i];
    if (drives[static_cast<std::size_t>(i)].gear_torque->Nm_per_count != 0.0) {
      sensors_ = static_cast<std::uint8_t>(sensors_ | 1u << i);
    }
  }
  state_.slow_Nm = state_.sum_Nms = state_.weight_Nm = state_.standing_Nm = JointVector::Zero(arm.axes());
  asked_Nm_.fill(JointVector::Zero(arm.axes()));
  set_period(period_s);
}

void GearDamping::set_period(double period_s) noexcept {
  period_s_ = period_s;
  decay_ = std::exp(-gear_damping_band_rad_per_s * period_s);
  lag_periods_ = gear_torque_lag_periods(drive_lag_s_, reading_delay_s_, period_s);
}

JointVector GearDamping::step(const JointVector& asked_Nm, const JointVector& measured_Nm) noexcept {
  if (!state_.started) {
    asked_Nm_.fill(asked_Nm);
    state_.slow_Nm = measured_Nm - asked_Nm;
    state_.sum_Nms.setZero();
    state_.started = true;
  }
  asked_Nm_[++state_.steps % kept] = asked_Nm;
  const double whole = std::floor(lag_periods_), rest = lag_periods_ - whole;
  const std::uint64_t then = state_.steps + kept - static_cast<std::uint64_t>(whole);
  const JointVector beside_Nm =
      measured_Nm - (1.0 - rest) * asked_Nm_[then % kept] - rest * asked_Nm_[(then - 1) % kept];
  state_.slow_Nm += (1.0 - decay_) * (beside_Nm - state_.slow_Nm);
  const double gain_s = (1.0 - decay_) / gear_damping_band_rad_per_s;
  state_.sum_Nms = decay_ * state_.sum_Nms + gain_s * (beside_Nm - state_.slow_Nm);
  return -yield_rad_per_Nms_.cwiseProduct(state_.sum_Nms);
}

void GearDamping::stand(const JointVector& weight_Nm, const JointVector& measured_Nm) noexcept {
  state_.weight_Nm += weight_Nm;
  state_.standing_Nm += measured_Nm;
  state_.stood_cycles += 1.0;
}

std::optional<GearDamping::Reversed> GearDamping::reversed() const noexcept {
  if (!(state_.stood_cycles > 0.0)) return std::nullopt;
  constexpr double least_share = 0.25, closer = 0.5;
  const double least_Nm = least_share * state_.weight_Nm.cwiseAbs().maxCoeff() / state_.stood_cycles;
  for (Eigen::Index i = 0; i < state_.weight_Nm.size(); ++i) {
    const double weight_Nm = state_.weight_Nm[i] / state_.stood_cycles;
    const double read_Nm = state_.standing_Nm[i] / state_.stood_cycles;
    if ((sensors_ & 1u << i) == 0 || !(std::abs(weight_Nm) >= least_Nm) || weight_Nm == 0.0) continue;
    if (std::abs(read_Nm + weight_Nm) < closer * std::abs(read_Nm - weight_Nm)) {
      return Reversed{static_cast<std::int32_t>(i), read_Nm, weight_Nm};
    }
  }
  return std::nullopt;
}

void GearDamping::start() noexcept {
  state_.started = false;
  state_.weight_Nm.setZero();
  state_.standing_Nm.setZero();
  state_.stood_cycles = 0.0;
}

void GearDamping::archive(fieldbus::StateArchive& state) noexcept {
  archive_fields(state, state_);
  for (JointVector& asked_Nm : asked_Nm_) state(asked_Nm);
}

}  // namespace proxarm::controller
