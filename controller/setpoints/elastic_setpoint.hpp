// Computes motor setpoints that move the links through elastic gears to the wanted angles.
//
// Encoders sit on the motors, so a drive that follows its setpoints exactly leaves the links oscillating at the arm's
// elastic modes (8–20 Hz, hardly damped). Masses after the force sensor feed that motion back as force: with a mass m_h
// after the sensor and a delay L, a mode ω of damping ζ is stable only for m_h/M < 2ζ/(ω L), so not below a few
// kilograms of felt mass M. Therefore the setpoints come from the arm's model:
//
//   q̈_f = ω²(q − q_f) − 2ω q̇_f                     a critically damped filter of the wanted link angles q
//   θ = q_f + K⁻¹[M(q_f) q̈_f + τ_g(q_f)]            motor angles whose gears carry this acceleration and gravity
//
// Links that obey the model follow q_f without oscillation and without overshoot at a wall. The price is a delay of
// 2/ω, which the stability check includes. Coriolis torques are left out: at 0.5 m/s they bend the gears by some
// micrometres. The hand's wrench isn't compensated: at the wrist, where the hand's mass is as large as the links', the
// reaction would come too late and make wall contact chatter. With bandwidth_Hz = 0 only gravity is compensated.
//
// No allocation, lock or throw after construction.
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
  // Continues from the motors' angles and speeds and discards the filter's state. The links are assumed to be as fast
  // as the motors.
  void resume(const models::JointVector& motor_rad, const models::JointVector& motor_rad_per_s) noexcept;
  // One period towards these link angles. Returns the motor setpoints.
  models::JointVector step(const models::JointVector& link_rad) noexcept;

  // Torques that the last step requires of the gears, M(q_f) q̈_f + τ_g, with the mean of q̈_f over the step. (At its
  // end q̈_f is off by ω² q̇_f T/2, because the filter's input is constant over the period. The motor is therefore 0.1 ms
  // early, but no gear carries this torque.)
  [[nodiscard]] models::JointVector asked_Nm() noexcept;
  // Jᵀh of a wrench about T.
  [[nodiscard]] models::JointVector joint_torques_Nm(const models::Wrench& wrench_W) const noexcept;

  // Its output is the commanded link angles and speeds.
  [[nodiscard]] const LinkFilter& filter() const noexcept { return filter_; }
  // The tool at the filter's output.
  [[nodiscard]] const models::ToolKinematics& kinematics() const noexcept { return kinematics_; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  const models::Arm* arm_;
  LinkFilter filter_;
  double period_s_;
  models::JointVector speed_before_rad_per_s_;  // of the filter, before the last step
  models::ToolKinematics kinematics_;
};

}  // namespace proxarm::controller
