// The control loop inside a simulated servo drive. It computes the motor torque from encoder and setpoint, and
// interpolates setpoints between SYNCs.
//
// The loop is a cascade that runs once per servo period h. With r the interpolated setpoint, θ the encoder's angle and
// e = r − θ:
//   v* = K_p e + f_v ṙ
//   τ  = clamp( K_v (v* − θ̇) + K_i ∫(v* − θ̇) dt + f_a J_r r̈,  ± τ_max ),   K_v = J_r ω_v,  K_i = K_v ω_v/10
// θ̇ is the difference of encoder counts over one servo period. All quantities except counts are at the joint, that is,
// after the gear ratio.
//
// A target that is given at SYNC is reached one interpolation period later, along a straight line from the current
// setpoint. For the feed-forward, ṙ ramps from the speed of the last segment to the speed of the new segment: a change
// of speed thus needs one period of constant torque instead of an impulse. If no new target comes, the last speed is
// kept for a quarter of a period, because a frame may delay SYNC. The setpoint then decelerates to rest at the drive's
// limit.
#pragma once

#include <cstdint>

#include "models/description/cell.hpp"

namespace proxarm::sim {

// Times are in ns of the network's clock. The functions neither allocate nor throw.
class ServoLoop {
 public:
  ServoLoop(const description::DriveDescription& drive, std::int64_t servo_period_ns) noexcept;

  // Switch the power. enable() holds the current position. To keep a load from dropping when the brake opens, enable()
  // begins with the torque that the drive held when it was last enabled; the first time this is holding_torque_Nm,
  // which carries gravity.
  void reset(double motor_angle_rad, double holding_torque_Nm) noexcept;  // switches the power off
  void enable(std::int64_t time_ns) noexcept;
  void disable() noexcept;
  [[nodiscard]] bool powered() const noexcept { return powered_; }

  // Sets the interpolation period (60C2h). It takes effect with the next target.
  void set_interpolation_period_ns(std::int64_t period_ns) noexcept { period_ns_ = period_ns; }

  // Limits the motor's torque; max_torque_Nm is the torque at the joint.
  void set_max_torque_Nm(double torque_Nm) noexcept { max_torque_Nm_ = torque_Nm; }

  // Must be called at SYNC with the latched 607Ah. Ignored without power. If the target requires more than the drive's
  // top speed, the setpoint lags behind its target (see limited()).
  void set_target(std::int32_t target_counts, std::int64_t time_ns) noexcept;
  // Decelerates to rest (rad/s²) and holds until the next set_target(). Used for a SYNC without a new target, for quick
  // stop and for halt.
  void stop(double deceleration_rad_per_s2, std::int64_t time_ns) noexcept;
  // Cyclic synchronous torque: applies 6071h, converted to torque at the joint, without position control, until
  // set_target() or stop().
  void set_torque_Nm(double torque_Nm) noexcept;

  // Runs one servo period: samples the encoder and returns the motor torque at the joint (Nm) for this period; 0
  // without power. Precondition: time_ns is a multiple of the servo period.
  double update(double motor_angle_rad, std::int64_t time_ns) noexcept;

  // The values of 6064h, 6062h, 60F4h and others at the last update().
  [[nodiscard]] std::int32_t position_counts() const noexcept { return counts_; }
  [[nodiscard]] std::int32_t demand_counts() const noexcept { return to_counts(setpoint_.position_rad); }
  [[nodiscard]] double following_error_rad() const noexcept { return setpoint_.position_rad - angle_rad_; }
  [[nodiscard]] double speed_rad_per_s() const noexcept { return speed_; }
  [[nodiscard]] double torque_Nm() const noexcept { return torque_Nm_; }
  [[nodiscard]] bool limited() const noexcept { return limited_; }               // torque or speed is at its limit
  [[nodiscard]] bool at_rest() const noexcept { return phase_ == Phase::hold; }  // true: the setpoint is at rest

 private:
  enum class Phase : std::uint8_t { hold, segment, stopping, torque };
  struct Setpoint {
    double position_rad = 0.0, speed = 0.0, feedforward_speed = 0.0, acceleration = 0.0;
  };

  [[nodiscard]] std::int32_t to_counts(double joint_rad) const noexcept;
  [[nodiscard]] double to_angle(std::int32_t counts) const noexcept;
  [[nodiscard]] Setpoint on_segment(std::int64_t time_ns) const noexcept;
  [[nodiscard]] Setpoint on_stop(std::int64_t time_ns) const noexcept;
  void hold_here() noexcept;
  void interpolate(std::int64_t time_ns) noexcept;
  void begin_stop(double deceleration, std::int64_t time_ns) noexcept;

  // Constant.
  double counts_per_rad_, offset_counts_, max_torque_Nm_, max_speed_, max_deceleration_;
  double rotor_inertia_, position_gain_, velocity_gain_, integral_gain_;
  double velocity_feedforward_, acceleration_feedforward_, servo_period_s_;
  std::int64_t period_ns_ = 1'000'000;

  // The setpoint. For a stop, segment_* hold start position, speed and start time of the stop.
  Phase phase_ = Phase::hold;
  std::int64_t segment_start_ns_ = 0, segment_end_ns_ = 0;
  double segment_from_rad_ = 0.0, segment_speed_ = 0.0, previous_speed_ = 0.0;
  double stop_deceleration_ = 0.0, torque_target_Nm_ = 0.0;
  Setpoint setpoint_;

  // State of the loop.
  bool powered_ = false, limited_ = false, speed_limited_ = false;
  std::int32_t counts_ = 0;
  double angle_rad_ = 0.0, speed_ = 0.0, integral_Nm_ = 0.0, torque_Nm_ = 0.0;
};

}  // namespace proxarm::sim
