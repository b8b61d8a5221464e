#include "controller/setpoints/elastic_setpoint.hpp"

namespace proxarm::controller {

using models::JointVector;

ElasticSetpoint::ElasticSetpoint(const models::Arm& arm, double bandwidth_Hz, double period_s)
    : arm_(&arm), filter_(bandwidth_Hz, period_s), period_s_(period_s) {
  start(arm.start_rad());
}

void ElasticSetpoint::start(const JointVector& link_rad) noexcept {
  filter_.start(link_rad);
  arm_->kinematics(filter_.rad(), kinematics_);
}

void ElasticSetpoint::resume(const JointVector& motor_rad, const JointVector& motor_rad_per_s) noexcept {
  filter_.resume(arm_->link_from_motor(motor_rad), motor_rad_per_s);
  arm_->kinematics(filter_.rad(), kinematics_);
}

void ElasticSetpoint::archive(fieldbus::StateArchive& state) noexcept {
  state(filter_);
  if (state.reading()) arm_->kinematics(filter_.rad(), kinematics_);
}

JointVector ElasticSetpoint::step(const JointVector& link_rad) noexcept {
  speed_before_rad_per_s_ = filter_.rad_per_s();
  const JointVector acceleration = filter_.step(link_rad);
  if (filter_.filters()) return arm_->motor_from_moving_link(filter_.rad(), acceleration, kinematics_);
  arm_->kinematics(link_rad, kinematics_);
  return arm_->motor_from_link(link_rad);
}

JointVector ElasticSetpoint::asked_Nm() noexcept {
  JointVector acceleration = JointVector::Zero(filter_.rad().size());
  if (filter_.filters()) acceleration = (filter_.rad_per_s() - speed_before_rad_per_s_) / period_s_;
  const JointVector motor_rad = arm_->motor_from_moving_link(filter_.rad(), acceleration, kinematics_);
  return arm_->gear_stiffness_Nm_per_rad().cwiseProduct(motor_rad - filter_.rad());
}

JointVector ElasticSetpoint::joint_torques_Nm(const models::Wrench& wrench_W) const noexcept {
  JointVector torques_Nm = kinematics_.J_W.topRows<3>().transpose() * wrench_W.force;
  torques_Nm += kinematics_.J_W.bottomRows<3>().transpose() * wrench_W.torque;
  return torques_Nm;
}

}  // namespace proxarm::controller
