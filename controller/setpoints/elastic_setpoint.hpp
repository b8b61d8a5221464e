// Motor setpoints that move the links through elastic gears to where the proxy wants them.
//
// Encoders sit on the motors, so a drive that follows its setpoints exactly leaves the links oscillating at the arm's
// elastic modes (8–20 Hz, hardly damped). Masses after the force sensor then feed that motion back as force, and below
// a few kilograms of felt mass M the loop is unstable: with a mass m_h after the sensor and a delay L, a mode ω of
// damping ζ is stable only for m_h/M < 2ζ/(ω L). So the setpoints are made from the arm's model instead:
//
//   q̈_f = ω²(q − q_f) − 2ω q̇_f                     a critically damped filter of the links' wanted angles q
//   θ = q_f + K⁻¹[M(q_f) q̈_f + τ_g(q_f)]            motor angles whose gears carry just that acceleration and gravity
//
// Links that obey the model follow q_f without oscillation and, at a wall, without overshoot. The price is a delay of
// 2/ω, which the stability check includes. Coriolis torques are left out: at 0.5 m/s they bend the gears by some
// micrometres. The hand's wrench isn't compensated either. Its reaction on the wrist, where the hand's mass is as large
// as the links', would come back too late, and made contact with a wall chatter. bandwidth_Hz = 0 disables it; then
// only gravity is compensated.
//
// Neither allocates, locks nor throws after construction.
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
  // Starts at rest at these angles of the links.
  void start(const models::JointVector& link_rad) noexcept;
  // Goes on from the motors' angles and speeds, and discards what the filter had accumulated. The links are taken to be
  // as fast as the motors; the speed of the gears' twist is neglected.
  void resume(const models::JointVector& motor_rad, const models::JointVector& motor_rad_per_s) noexcept;
  // One period towards these angles of the links. Returns the motors' setpoints.
  models::JointVector step(const models::JointVector& link_rad) noexcept;

  // What the last step asks of the gears, M(q_f) q̈_f + τ_g, by the mean of q̈_f over it. (At the step's end q̈_f is off
  // by ω² q̇_f T/2, since the filter's input is held over the period: a motor is 0.1 ms early by that, which its gear
  // doesn't carry.)
  [[nodiscard]] models::JointVector asked_Nm() noexcept;
  // Jᵀh of a wrench about T.
  [[nodiscard]] models::JointVector joint_torques_Nm(const models::Wrench& wrench_W) const noexcept;

  // Its output is the links' angles and speeds as they are commanded now.
  [[nodiscard]] const LinkFilter& filter() const noexcept { return filter_; }
  // Of the tool, at these angles.
  [[nodiscard]] const models::ToolKinematics& kinematics() const noexcept { return kinematics_; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  const models::Arm* arm_;
  LinkFilter filter_;
  double period_s_;
  models::JointVector speed_before_rad_per_s_;  // of the filter, before the last step
  models::ToolKinematics kinematics_;           // at the filter's output
};

}  // namespace proxarm::controller
