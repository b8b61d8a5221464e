#include "controller/setpoints/elastic_setpoint.hpp"

#include <cmath>
#include <numbers>

namespace proxarm::controller {

using models::JointVector;

ElasticSetpoint::ElasticSetpoint(const models::Arm& arm, double bandwidth_Hz, double period_s)
    : arm_(&arm),
      omega_rad_per_s_(2.0 * std::numbers::pi * bandwidth_Hz),
      angle_rad_(arm.start_rad()),
      speed_rad_per_s_(JointVector::Zero(arm.axes())) {
  set_period(period_s);
  arm.kinematics(angle_rad_, kinematics_);
}

void ElasticSetpoint::set_period(double period_s) noexcept {
  period_s_ = period_s;
  decay_ = std::exp(-omega_rad_per_s_ * period_s);
}

void ElasticSetpoint::start(const JointVector& link_rad) noexcept {
  angle_rad_ = link_rad;
  speed_rad_per_s_.setZero();
  arm_->kinematics(angle_rad_, kinematics_);
}

void ElasticSetpoint::resume(const JointVector& motor_rad, const JointVector& motor_rad_per_s) noexcept {
  angle_rad_ = arm_->link_from_motor(motor_rad);
  speed_rad_per_s_ = motor_rad_per_s;
  arm_->kinematics(angle_rad_, kinematics_);
}

void ElasticSetpoint::archive(fieldbus::StateArchive& state) noexcept {
  state(angle_rad_, speed_rad_per_s_);
  if (state.reading()) arm_->kinematics(angle_rad_, kinematics_);
}

// From ė(T) of step(), whose c is v − ωd for the input q_f + d: (ė(T) − v)/T = a where
//   d = (v (exp(ωT) − 1 + ωT) + aT exp(ωT)) / (ω²T)
JointVector ElasticSetpoint::coasting_rad() const noexcept {
  const double omega = omega_rad_per_s_, T = period_s_;
  return angle_rad_ + (1.0 / decay_ - 1.0 + omega * T) / (omega * omega * T) * speed_rad_per_s_;
}

JointVector ElasticSetpoint::step(const JointVector& link_rad) noexcept {
  if (omega_rad_per_s_ <= 0.0) {
    angle_rad_ = link_rad;
    arm_->kinematics(angle_rad_, kinematics_);
    return arm_->motor_from_link(link_rad);
  }
  // With e = q_f − q and q constant over the period:  e(T) = (e + (ė + ωe)T) exp(−ωT),
  //                                                  ė(T) = (ė − ω(ė + ωe)T) exp(−ωT)
  const double omega = omega_rad_per_s_, T = period_s_;
  const JointVector e = angle_rad_ - link_rad;
  const JointVector c = speed_rad_per_s_ + omega * e;
  angle_rad_ = link_rad + decay_ * (e + T * c);
  speed_rad_per_s_ = decay_ * (speed_rad_per_s_ - omega * T * c);
  const JointVector acceleration = omega * omega * (link_rad - angle_rad_) - 2.0 * omega * speed_rad_per_s_;
  return arm_->motor_from_moving_link(angle_rad_, acceleration, kinematics_);
}

}  // namespace proxarm::controller
