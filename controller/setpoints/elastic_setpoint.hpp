// Computes motor setpoints that move the links through elastic gears to the wanted angles.
//
// Encoders sit on the motors, so a drive that follows its setpoints exactly leaves the links oscillating at the arm's
// elastic modes (8–20 Hz, hardly damped). A mass m_h behind the force sensor feeds the oscillation back as a force.
// With a delay L, a mode ω of damping ζ is stable only if m_h/M < 2ζ/(ω L), that is with a felt mass M of at least a
// few kilograms. Therefore the setpoints come from the arm's model:
//
//   q̈_f = ω²(q − q_f) − 2ω q̇_f                     a critically damped filter of the wanted link angles q
//   θ = q_f + K⁻¹[M(q_f) q̈_f + τ_g(q_f)]            motor angles whose gears carry q̈_f and gravity
//
// Links that obey the model follow q_f without oscillation and without overshoot at a wall. The price is a delay of
// 2/ω, which the stability check includes. Two torques are left out. Coriolis torques bend the gears by only some
// micrometres at 0.5 m/s. The torque of the hand's wrench would be compensated too late at the wrist, where the hand's
// mass is as large as the links' mass, and contact with a wall would chatter. With bandwidth_Hz = 0 only gravity is
// compensated.
//
// Nothing allocates, locks or throws after construction.
#pragma once

#include "controller/setpoints/link_filter.hpp"
#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

class ElasticSetpoint {
 public:
  // Precondition: `arm` outlives this object.
  ElasticSetpoint(const models::Arm& arm, double bandwidth_Hz, double period_s);

  void set_period(double period_s) noexcept {
    period_s_ = period_s;
    filter_.set_period(period_s);
  }
  // Starts at rest at these link angles.
  void start(const models::JointVector& link_rad) noexcept;
  // Continues from the motors' angles and speeds, and discards the filter's state. The links' speeds are assumed to
  // equal the motors' speeds.
  void resume(const models::JointVector& motor_rad, const models::JointVector& motor_rad_per_s) noexcept;
  // Filters the wanted link angles for one period. Returns the motor setpoints.
  models::JointVector step(const models::JointVector& link_rad) noexcept;

  // Returns the torques that the last step requires of the gears, M(q_f) q̈_f + τ_g, with the mean of q̈_f over the
  // step. The mean is used because q̈_f at the step's end is off by ω² q̇_f T/2, since the filter's input is constant
  // over the period. Setpoints with this error make the motors 0.1 ms early, but no gear carries the error as a torque.
  [[nodiscard]] models::JointVector asked_Nm() noexcept;
  // Returns Jᵀh, the joint torques of a wrench h about T.
  [[nodiscard]] models::JointVector joint_torques_Nm(const models::Wrench& wrench_W) const noexcept;

  // The filter; its output is the commanded link angles and speeds.
  [[nodiscard]] const LinkFilter& filter() const noexcept { return filter_; }
  // The tool's kinematics at the filter's output.
  [[nodiscard]] const models::ToolKinematics& kinematics() const noexcept { return kinematics_; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  const models::Arm* arm_;
  LinkFilter filter_;
  double period_s_;
  models::JointVector speed_before_rad_per_s_;  // the filter's speed before the last step
  models::ToolKinematics kinematics_;
};

}  // namespace proxarm::controller
