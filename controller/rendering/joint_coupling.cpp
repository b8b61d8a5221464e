#include "controller/rendering/joint_coupling.hpp"

#include <algorithm>
#include <cmath>

#include "controller/setpoints/joint_guard.hpp"

namespace proxarm::controller {

using models::Jacobian;
using models::JointMatrix;
using models::JointVector;
using models::Vec3;

namespace {

// The share of a speed limit that the proxy keeps to. A hand of 50 N on the 0.5 kg of a light device is faster than
// the proxy by 0.2 m/s for 10 ms, until K and B have answered.
constexpr double speed_share = 0.75;
// The share of a joint's acceleration by which the proxy brakes. A hand's mass of 1 kg triples what the elbow of a light
// device brakes.
constexpr double braking_share = 0.5;
// The ball |J u| ≤ vT is cut by tangent planes, each at the point that the ones before led to. Each cut leaves the
// square of the angle of the one before: after six, rounding. What is left is taken off by scaling.
constexpr int most_cuts = 6;
// Of vT: below it a cut changes nothing that an encoder could tell.
constexpr double cut_tolerance = 1e-9;

}  // namespace

JointCoupling::JointCoupling(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                             const description::CellLimits& limits, double period_s)
    : arm_(&arm), tool_speed_m_per_s_(speed_share * limits.max_tool_speed_m_per_s), period_s_(period_s) {
  for (const description::DriveDescription& drive : drives) {
    joints_.push_back({drive.range_rad[0], drive.range_rad[1], speed_share * drive.max_speed_rad_per_s,
                       braking_share * drive.max_acceleration_rad_per_s2});
  }
  start(JointVector::Zero(static_cast<Eigen::Index>(joints_.size())));
}

void JointCoupling::start(const JointVector& link_rad) noexcept {
  c_k1_ = phi_k1_ = link_rad;
  torque_Nm_ = JointVector::Zero(link_rad.size());
  active_ = {};
}

const JointVector& JointCoupling::step(const JointVector& link_rad, const Jacobian& J_W,
                                       double max_tool_speed_m_per_s) noexcept {
  active_ = {};
  torque_Nm_.setZero();
  if (!link_rad.allFinite()) return torque_Nm_;
  constexpr double gamma = stiffness_share, beta = damping_share;
  const double T = period_s_;
  const JointVector u_hat = link_rad + beta / (gamma + beta) * (c_k1_ - phi_k1_) - c_k1_;  // (23a)
  const double tool_step_m = T * std::min(tool_speed_m_per_s_, max_tool_speed_m_per_s);
  const Box free = box();
  const bool inside = (u_hat.array() >= free.lower.array()).all() && (u_hat.array() <= free.upper.array()).all() &&
                      (J_W.topRows<3>() * u_hat).norm() <= tool_step_m;
  JointVector u = u_hat;
  if (!inside) {
    const JointMatrix M = arm_->mass_matrix(link_rad);
    u = nearest(u_hat, M, J_W, tool_step_m);                     // (23b)
    torque_Nm_ = (gamma + beta) / (T * T) * (M * (u - u_hat));  // (23c)
    if (tool_step_m > 0.0) note_active(u, free, (J_W.topRows<3>() * u).norm() > 0.999 * tool_step_m);
  }
  c_k1_ += u;
  phi_k1_ = link_rad;
  return torque_Nm_;
}

JointCoupling::Box JointCoupling::box() const noexcept {
  const double T = period_s_;
  Box box{c_k1_, c_k1_};
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    const auto k = static_cast<Eigen::Index>(i);
    const double a = joint.acceleration_rad_per_s2;
    box.lower[k] = -T * std::min(joint.speed_rad_per_s, approach_speed(c_k1_[k] - joint.lower_rad, a, T));
    box.upper[k] = T * std::min(joint.speed_rad_per_s, approach_speed(joint.upper_rad - c_k1_[k], a, T));
  }
  return box;
}

JointVector JointCoupling::nearest(const JointVector& u_hat, const JointMatrix& M, const Jacobian& J_W,
                                   double tool_step_m) noexcept {
  const JointVector still = JointVector::Zero(u_hat.size());
  if (!(tool_step_m > 0.0)) return still;
  const Box free = box();
  program_.start(M, M * u_hat);
  for (Eigen::Index i = 0; i < u_hat.size(); ++i) {
    const JointVector axis = JointVector::Unit(u_hat.size(), i);
    program_.at_most(axis, free.upper[i]);
    program_.at_most(-axis, -free.lower[i]);
  }
  for (int cut = 0;; ++cut) {
    if (!program_.solve()) return still;
    const Vec3 step_W = J_W.topRows<3>() * program_.u();
    const double length_m = step_W.norm();
    if (length_m <= (1.0 + cut_tolerance) * tool_step_m) return program_.u();
    if (cut == most_cuts) return tool_step_m / length_m * program_.u();
    program_.at_most(J_W.topRows<3>().transpose() * (step_W / length_m), tool_step_m);
  }
}

// A bound is active where the step lies on it.
void JointCoupling::note_active(const JointVector& u, const Box& box, bool tool) noexcept {
  const double T = period_s_;
  if (tool) active_.set(Limit::speed);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double room = 1e-9 * T * joints_[i].speed_rad_per_s;  // the program's rounding
    for (const double bound : {box.lower[k], box.upper[k]}) {
      if (std::abs(u[k] - bound) > room) continue;
      const bool fast = std::abs(bound) >= T * joints_[i].speed_rad_per_s;
      active_.set(fast ? Limit::joint_speed : Limit::joint_range, static_cast<std::uint8_t>(1u << i));
    }
  }
}

}  // namespace proxarm::controller
