#include "sim/physics/servo_loop.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace proxarm::sim {

ServoLoop::ServoLoop(const description::DriveDescription& drive, std::int64_t servo_period_ns) noexcept
    : counts_per_rad_(drive.counts_per_motor_revolution * drive.gear_ratio * drive.direction / (2.0 * M_PI)),
      offset_counts_(drive.offset_counts),
      max_torque_Nm_(drive.simulation.max_torque_Nm),
      max_speed_(drive.max_speed_rad_per_s),
      max_deceleration_(drive.max_acceleration_rad_per_s2),
      rotor_inertia_(drive.rotor_inertia_kg_m2),
      position_gain_(drive.simulation.position_gain_per_s),
      velocity_gain_(drive.rotor_inertia_kg_m2 * 2.0 * M_PI * drive.simulation.velocity_bandwidth_Hz),
      integral_gain_(velocity_gain_ * 2.0 * M_PI * drive.simulation.velocity_bandwidth_Hz / 10.0),
      velocity_feedforward_(drive.simulation.velocity_feedforward),
      acceleration_feedforward_(drive.simulation.acceleration_feedforward),
      servo_period_s_(1e-9 * static_cast<double>(servo_period_ns)) {}

std::int32_t ServoLoop::to_counts(double joint_rad) const noexcept {
  constexpr double low = std::numeric_limits<std::int32_t>::min(), high = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::clamp(std::nearbyint(joint_rad * counts_per_rad_ + offset_counts_), low, high));
}

double ServoLoop::to_angle(std::int32_t counts) const noexcept {
  return (static_cast<double>(counts) - offset_counts_) / counts_per_rad_;
}

void ServoLoop::reset(double motor_angle_rad, double holding_torque_Nm) noexcept {
  powered_ = false;
  limited_ = false;
  counts_ = to_counts(motor_angle_rad);
  angle_rad_ = to_angle(counts_);
  speed_ = torque_Nm_ = 0.0;
  integral_Nm_ = holding_torque_Nm;
  hold_here();
}

void ServoLoop::hold_here() noexcept {
  phase_ = Phase::hold;
  setpoint_ = {.position_rad = angle_rad_};
}

void ServoLoop::enable(std::int64_t /*time_ns*/) noexcept {
  if (powered_) return;
  hold_here();
  powered_ = true;
}

void ServoLoop::disable() noexcept {
  powered_ = false;
  torque_Nm_ = 0.0;
  hold_here();
}

ServoLoop::Setpoint ServoLoop::on_segment(std::int64_t time_ns) const noexcept {
  const double elapsed = 1e-9 * static_cast<double>(time_ns - segment_start_ns_);
  const double length = 1e-9 * static_cast<double>(segment_end_ns_ - segment_start_ns_);
  const double change = segment_speed_ - previous_speed_;
  return {.position_rad = segment_from_rad_ + segment_speed_ * elapsed,
          .speed = segment_speed_,
          .feedforward_speed = previous_speed_ + change * std::min(1.0, elapsed / length),
          .acceleration = elapsed < length ? change / length : 0.0};
}

ServoLoop::Setpoint ServoLoop::on_stop(std::int64_t time_ns) const noexcept {
  const double elapsed = 1e-9 * static_cast<double>(time_ns - segment_start_ns_);
  const double v = segment_speed_, a = stop_deceleration_;
  if (std::abs(v) <= a * elapsed) return {.position_rad = segment_from_rad_ + 0.5 * v * std::abs(v) / a};
  const double speed = v - std::copysign(a * elapsed, v);
  return {.position_rad = segment_from_rad_ + 0.5 * (v + speed) * elapsed,
          .speed = speed,
          .feedforward_speed = speed,
          .acceleration = std::copysign(a, -v)};
}

void ServoLoop::interpolate(std::int64_t time_ns) noexcept {
  if (phase_ == Phase::segment) {
    const std::int64_t patience_end_ns = segment_end_ns_ + (segment_end_ns_ - segment_start_ns_) / 4;
    if (time_ns <= patience_end_ns) {
      setpoint_ = on_segment(time_ns);
      return;
    }
    setpoint_ = on_segment(patience_end_ns);
    begin_stop(max_deceleration_, patience_end_ns);
  }
  if (phase_ == Phase::stopping) {
    setpoint_ = on_stop(time_ns);
    if (setpoint_.speed == 0.0) phase_ = Phase::hold;
  } else if (phase_ == Phase::torque) {
    setpoint_ = {.position_rad = angle_rad_};
  }
}

void ServoLoop::begin_stop(double deceleration, std::int64_t time_ns) noexcept {
  segment_start_ns_ = time_ns;
  segment_from_rad_ = setpoint_.position_rad;
  segment_speed_ = setpoint_.speed;
  stop_deceleration_ = deceleration;
  phase_ = Phase::stopping;
}

void ServoLoop::set_target(std::int32_t target_counts, std::int64_t time_ns) noexcept {
  if (!powered_) return;
  interpolate(time_ns);
  const double period = 1e-9 * static_cast<double>(period_ns_);
  const double wanted = (to_angle(target_counts) - setpoint_.position_rad) / period;
  segment_speed_ = std::clamp(wanted, -max_speed_, max_speed_);
  speed_limited_ = segment_speed_ != wanted;
  segment_from_rad_ = setpoint_.position_rad;
  previous_speed_ = setpoint_.feedforward_speed;
  segment_start_ns_ = time_ns;
  segment_end_ns_ = time_ns + period_ns_;
  phase_ = Phase::segment;
}

void ServoLoop::stop(double deceleration_rad_per_s2, std::int64_t time_ns) noexcept {
  if (!powered_ || phase_ == Phase::hold || phase_ == Phase::stopping) return;
  const bool from_torque = phase_ == Phase::torque;
  interpolate(time_ns);
  if (phase_ == Phase::stopping || phase_ == Phase::hold) return;  // without targets, the setpoint had already stopped
  if (from_torque) setpoint_ = {.position_rad = angle_rad_, .speed = speed_};
  begin_stop(deceleration_rad_per_s2, time_ns);
}

void ServoLoop::set_torque_Nm(double torque_Nm) noexcept {
  if (!powered_) return;
  phase_ = Phase::torque;
  torque_target_Nm_ = torque_Nm;
}

double ServoLoop::update(double motor_angle_rad, std::int64_t time_ns) noexcept {
  counts_ = to_counts(motor_angle_rad);
  const double angle = to_angle(counts_);
  speed_ = (angle - angle_rad_) / servo_period_s_;
  angle_rad_ = angle;
  if (!powered_) {
    hold_here();
    return torque_Nm_ = 0.0;
  }
  interpolate(time_ns);
  if (phase_ == Phase::torque) {
    torque_Nm_ = std::clamp(torque_target_Nm_, -max_torque_Nm_, max_torque_Nm_);
    limited_ = torque_Nm_ != torque_target_Nm_;
    integral_Nm_ = torque_Nm_;  // lets position control take over later without a step in torque
    return torque_Nm_;
  }
  //   v* = K_p e + f_v ṙ
  //   τ  = K_v (v* − θ̇) + K_i ∫(v* − θ̇) dt + f_a J_r r̈
  const double error = setpoint_.position_rad - angle_rad_;
  const double wanted_speed = position_gain_ * error + velocity_feedforward_ * setpoint_.feedforward_speed;
  const double speed_error = wanted_speed - speed_;
  const double integral = integral_Nm_ + integral_gain_ * speed_error * servo_period_s_;
  const double wanted =
      velocity_gain_ * speed_error + integral + acceleration_feedforward_ * rotor_inertia_ * setpoint_.acceleration;
  torque_Nm_ = std::clamp(wanted, -max_torque_Nm_, max_torque_Nm_);
  const bool torque_limited = torque_Nm_ != wanted;
  // At the torque limit, the integral may only change towards a smaller torque.
  if (!torque_limited || speed_error * wanted < 0.0) integral_Nm_ = integral;
  limited_ = torque_limited || (speed_limited_ && phase_ == Phase::segment);
  return torque_Nm_;
}

}  // namespace proxarm::sim
