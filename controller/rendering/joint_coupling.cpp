#include "controller/rendering/joint_coupling.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "controller/limits/braking.hpp"

namespace proxarm::controller {

using models::Jacobian;
using models::JointMatrix;
using models::JointVector;
using models::Vec3;

namespace {

// Shares of the speed limits that the proxy may use. A hand that suddenly pushes 50 N on the 0.5 kg of a light device
// moves it faster than the proxy by some tenths of m/s for 20 ms, until K and B have responded.
constexpr double joint_speed_share = 0.75, tool_speed_share = 0.4;
// Share of a joint's maximum acceleration with which the proxy brakes. A hand's mass of 1 kg triples the inertia at the
// elbow of a light device, and the hand may keep pushing with most of the drive's torque.
constexpr double braking_share = 0.2;
// Number of tangent planes that approximate the ball |J u| ≤ vT. Each plane touches the ball in the direction of the
// solution with the planes before it, and squares the remaining angle between solution and ball. After six planes only
// rounding remains, which scaling removes.
constexpr int most_cuts = 6;
// Tolerance as a share of a bound. Smaller differences are the program's rounding.
constexpr double rounding = 1e-9;

}  // namespace

std::size_t JointCoupling::mean_steps(double period_s) noexcept {
  return static_cast<std::size_t>(std::clamp(std::round(mean_s / period_s), 1.0, static_cast<double>(most_steps)));
}

JointCoupling::JointCoupling(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                             const description::CellLimits& limits, double period_s)
    : arm_(&arm),
      tool_speed_m_per_s_(tool_speed_share * limits.max_tool_speed_m_per_s),
      period_s_(period_s),
      t_s_(std::max(period_s, shortest_s)),
      steps_(mean_steps(period_s)) {
  for (const description::DriveDescription& drive : drives) {
    joints_.push_back({drive.range_rad[0], drive.range_rad[1], joint_speed_share * drive.max_speed_rad_per_s,
                       braking_share * drive.max_acceleration_rad_per_s2, drive.max_torque_Nm});
  }
  start(JointVector::Zero(static_cast<Eigen::Index>(joints_.size())));
}

void JointCoupling::start(const JointVector& link_rad) noexcept {
  c_k1_ = phi_k1_ = c_hat_ = link_rad;
  torque_Nm_ = JointVector::Zero(link_rad.size());
  given_.fill({torque_Nm_, 0.0});
  released_N_ = 0.0;
  active_ = {};
}

const JointVector& JointCoupling::step(const JointVector& link_rad, const Jacobian& J_W,
                                       const Bounds& bounds) noexcept {
  active_ = {};
  Given& given = given_[next_++ % steps_];
  given.torque_Nm.setZero();
  given.released_N = 0.0;
  if (link_rad.allFinite()) {
    const double K = stiffness_share / (t_s_ * t_s_), B = damping_share / t_s_, T = period_s_;  // divided by M
    const JointMatrix M = arm_->mass_matrix(link_rad);
    const JointVector u_hat = link_rad + B / (K * T + B) * (c_k1_ - phi_k1_) - c_k1_;  // (23a)
    const Box free = box(M);
    double paid = 0.0;
    const JointVector u = nearest(u_hat, M, J_W, free, bounds, bounds.force_N / (K + B / T), paid);  // (23b)
    const JointVector lever = J_W.topRows<3>().transpose() * bounds.n_W;
    given.torque_Nm = (K + B / T) * (M * (u - u_hat) + paid * lever);  // (23c)
    given.released_N = (K + B / T) * paid;
    if (bounds.tool_speed_m_per_s > 0.0) note_active(u, free);
    c_hat_ = c_k1_ + u_hat;
    c_k1_ += u;
    phi_k1_ = link_rad;
  }
  take_mean();
  return torque_Nm_;
}

// Computes the means over the last steps_ steps.
void JointCoupling::take_mean() noexcept {
  torque_Nm_.setZero();
  released_N_ = 0.0;
  const double share = 1.0 / static_cast<double>(steps_);
  for (std::size_t i = 0; i < steps_; ++i) {
    torque_Nm_ += share * given_[i].torque_Nm;
    released_N_ += share * given_[i].released_N;
  }
}

JointCoupling::Box JointCoupling::box(const JointMatrix& M) const noexcept {
  const double T = period_s_;
  const JointMatrix inverse = M.llt().solve(JointMatrix::Identity(M.rows(), M.cols()));
  Box box{c_k1_, c_k1_};
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    const auto k = static_cast<Eigen::Index>(i);
    const double a = joint.acceleration_rad_per_s2, v = joint.speed_rad_per_s;
    const double pressed_rad = joint.max_torque_Nm * t_s_ * t_s_ / stiffness_share * inverse(k, k);
    box.lower[k] = -T * std::min(v, approach_speed(c_k1_[k] - joint.lower_rad - pressed_rad, a, T));
    box.upper[k] = T * std::min(v, approach_speed(joint.upper_rad - pressed_rad - c_k1_[k], a, T));
  }
  return box;
}

// The multiplier of the release's row may be at most `price`. If the multiplier would be larger, the program is solved
// again without this row, and with the force `price` in the row's direction.
JointVector JointCoupling::nearest(const JointVector& u_hat, const JointMatrix& M, const Jacobian& J_W, const Box& box,
                                   const Bounds& bounds, double price, double& paid) noexcept {
  const JointVector still = JointVector::Zero(u_hat.size());
  const double tool_step_m = period_s_ * std::min(tool_speed_m_per_s_, bounds.tool_speed_m_per_s);
  if (!(tool_step_m > 0.0)) return still;
  const bool inside = (u_hat.array() >= box.lower.array()).all() && (u_hat.array() <= box.upper.array()).all();
  const Vec3 moved_W = J_W.topRows<3>() * u_hat;
  const bool lets_go = price > 0.0 && bounds.n_W.dot(moved_W) > bounds.step_m;
  if (inside && !lets_go && moved_W.norm() <= tool_step_m) return u_hat;
  const JointVector lever = J_W.topRows<3>().transpose() * bounds.n_W;
  for (const bool pays_all : {false, true}) {
    program_.start(M, M * u_hat - (pays_all ? price : 0.0) * lever);
    if (!pays_all && price > 0.0) program_.at_most(lever, bounds.step_m);
    for (Eigen::Index i = 0; i < u_hat.size(); ++i) {
      const JointVector axis = JointVector::Unit(u_hat.size(), i);
      program_.at_most(axis, box.upper[i]);
      program_.at_most(-axis, -box.lower[i]);
    }
    const JointVector u = cut(J_W, tool_step_m);
    paid = pays_all ? price : price > 0.0 ? program_.multiplier(0) : 0.0;
    if (paid <= price) return u;
  }
  return still;
}

JointVector JointCoupling::cut(const Jacobian& J_W, double tool_step_m) noexcept {
  for (int cut = 0;; ++cut) {
    if (!program_.solve()) return JointVector::Zero(J_W.cols());
    const Vec3 step_W = J_W.topRows<3>() * program_.u();
    const double length_m = step_W.norm();
    if (length_m <= (1.0 + rounding) * tool_step_m) return program_.u();
    active_.set(Limit::speed);
    if (cut == most_cuts) return tool_step_m / length_m * program_.u();
    const JointVector normal = J_W.topRows<3>().transpose() * (step_W / length_m);
    program_.at_most(normal, tool_step_m);
  }
}

// A joint's bound is active if the step reaches it.
void JointCoupling::note_active(const JointVector& u, const Box& box) noexcept {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double most_rad = period_s_ * joints_[i].speed_rad_per_s;
    for (const double bound : {box.lower[k], box.upper[k]}) {
      if (std::abs(u[k] - bound) > rounding * most_rad) continue;
      active_.set(std::abs(bound) >= most_rad ? Limit::joint_speed : Limit::joint_range,
                  static_cast<std::uint8_t>(1u << i));
    }
  }
}

}  // namespace proxarm::controller
