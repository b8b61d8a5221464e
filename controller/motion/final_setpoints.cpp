#include "controller/motion/final_setpoints.hpp"

#include <algorithm>
#include <cmath>

#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

using models::JointVector;

FinalSetpoints::FinalSetpoints(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                               const description::CellLimits& limits, double period_s)
    : drives_(drives),
      limits_(limits),
      period_s_(period_s),
      guard_(drives_, period_s),
      tool_guard_(arm, drives_, limits, period_s),
      lever_(arm.path_curvature().diagonal()) {
  lever_ /= lever_.maxCoeff();
  state_.run_out_rad_per_s = JointVector::Zero(arm.axes());
  start(arm.start_rad());
}

void FinalSetpoints::set_period(double period_s) noexcept {
  period_s_ = period_s;
  guard_.set_period(period_s);
  tool_guard_.set_period(period_s);
}

void FinalSetpoints::start(const JointVector& target_rad) noexcept {
  guard_.start(target_rad);
  tool_guard_.start(target_rad);
  envelope_.start(target_rad);
}

FinalSetpoints::Result FinalSetpoints::step(const JointVector& motor_rad, const Measured& measured,
                                            const Bounds& bounds) noexcept {
  Result result;
  JointVector wanted_rad = motor_rad;
  result.blocked = find_blocked(motor_rad, measured, wanted_rad);
  if (result.blocked != 0) result.limits.set(Limit::following_error, result.blocked);
  result.limits.add(guard(wanted_rad, &bounds, result.guarded));
  follow(measured, result.blocked);
  result.differs = result.blocked != 0 || lag_rad() > limits_.following_error_rad;
  return result;
}

// Returns the lag of the joint that holds the tool back most, converted to an angle of the joint with the longest
// lever.
double FinalSetpoints::lag_rad() const noexcept { return guard_.lag_rad().cwiseAbs().cwiseProduct(lever_).maxCoeff(); }

JointVector FinalSetpoints::go_on_from_here(std::uint8_t blocked) noexcept {
  guard_.follow_from_here(blocked);
  return guard_.speed_rad_per_s();
}

// Applies the guards of joints and tool. `bounds` null: for braking, whose setpoints were judged before it began.
ActiveLimits FinalSetpoints::guard(const JointVector& wanted_rad, const Bounds* bounds, bool& held_back) noexcept {
  ActiveLimits active = guard_.step(wanted_rad);
  const ActiveLimits by_tool =
      bounds != nullptr
          ? tool_guard_.step(guard_.target_rad(), bounds->max_speed_m_per_s, &bounds->links_W, bounds->turn)
          : tool_guard_.step(guard_.target_rad(), limits_.max_tool_speed_m_per_s, nullptr, nullptr);
  held_back = by_tool.kinds != 0;
  if (!held_back) return active;
  active.add(by_tool);
  guard_.settle(tool_guard_.target_rad(), tool_guard_.speed_rad_per_s());
  return active;
}

// The braking time is the longest time that a joint needs at its maximum deceleration.
void FinalSetpoints::start_run_out() noexcept {
  double stop_s = period_s_;
  for (Eigen::Index i = 0; i < guard_.speed_rad_per_s().size(); ++i) {
    const double deceleration = drives_[static_cast<std::size_t>(i)].max_acceleration_rad_per_s2;
    stop_s = std::max(stop_s, std::abs(guard_.speed_rad_per_s()[i]) / deceleration);
  }
  guard_.follow_from_here();
  state_ = {guard_.speed_rad_per_s(), 1.0, period_s_ / stop_s};
}

ActiveLimits FinalSetpoints::run_out() noexcept {
  state_.run_out_share = std::max(0.0, state_.run_out_share - state_.run_out_per_cycle);
  bool held_back = false;
  return guard(guard_.target_rad() + state_.run_out_share * period_s_ * state_.run_out_rad_per_s, nullptr, held_back);
}

// Finds the joints whose drives are blocked, and returns them as bits. The setpoint of a blocked drive stays close to
// the drive's reported position, and all other joints wait. So gears wind up little, and nothing snaps when the drive
// comes free. The allowed distance between setpoint and reported position grows with speed, since a drive that follows
// reports its position late, by the delay of setpoint and report.
//
// A false report must not move the setpoint. θ: the reported position. r: the allowed distance. w: the wanted setpoint.
// [l, h]: the envelope of the setpoints that were sent before the joint was blocked (setpoint_envelope.hpp). The
// commanded setpoint is
//     c = clamp(clamp(w, θ − r, θ + r), min(l, w), max(h, w))
//   1. If the joint has jammed, θ is between l and h, so c = θ ± r: the setpoint brakes and returns to the joint.
//   2. If θ isn't between l and h, the report is false, and c is w or a place to which the joint was sent before.
//   3. With nobody at the handle, proxy and filter continue from the last setpoint, so l = h = w = c stays constant for
//      any θ.
//   4. With a hand, c goes no further than w, which follows from the hand's force.
// So no sequence of reports moves the arm by more than it has moved within the drive's lag, and without a hand no
// sequence of reports moves it.
std::uint8_t FinalSetpoints::find_blocked(const JointVector& motor_rad, const Measured& measured,
                                          JointVector& wanted_rad) const noexcept {
  std::uint8_t blocked = 0;
  for (Eigen::Index i = 0; i < motor_rad.size(); ++i) {
    const auto bit = static_cast<std::uint8_t>(1u << i);
    if ((measured.fresh & bit) == 0) continue;
    const double lag_s = following_lag_s(drives_[static_cast<std::size_t>(i)], period_s_, measured.answers.period_s[i]);
    const double room_rad = limits_.following_error_rad + lag_s / period_s_ * std::abs(measured.moved_rad[i]);
    const double actual_rad = measured.motor_rad[i];
    if (std::abs(motor_rad[i] - actual_rad) <= room_rad) continue;
    blocked |= bit;
    wanted_rad[i] =
        std::clamp(std::clamp(motor_rad[i], actual_rad - room_rad, actual_rad + room_rad),
                   std::min(envelope_.low_rad(i), motor_rad[i]), std::max(envelope_.high_rad(i), motor_rad[i]));
  }
  if (blocked == 0) return 0;
  for (Eigen::Index i = 0; i < motor_rad.size(); ++i) {
    if ((blocked & 1u << i) == 0) wanted_rad[i] = guard_.target_rad()[i];
  }
  return blocked;
}

// Updates the envelopes of the joints that aren't blocked.
void FinalSetpoints::follow(const Measured& measured, std::uint8_t blocked) noexcept {
  for (Eigen::Index i = 0; i < measured.axes(); ++i) {
    if ((blocked & 1u << i) != 0) continue;
    envelope_.step(i, guard_.target_rad()[i], period_s_,
                   following_lag_s(drives_[static_cast<std::size_t>(i)], period_s_, measured.answers.period_s[i]));
  }
}

void FinalSetpoints::archive(fieldbus::StateArchive& state) noexcept {
  state(guard_, tool_guard_, envelope_);
  archive_fields(state, state_);
}

}  // namespace proxarm::controller
