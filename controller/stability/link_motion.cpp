#include "controller/stability/link_motion.hpp"

#include "models/geometry/linear_systems.hpp"

namespace proxarm::controller {

using models::JointMatrix;
using models::JointVector;
using models::Mat3;
using models::Vec3;

LinkMotion::LinkMotion(const models::Arm& arm, const LinkMotionConfig& config, double period_s)
    : arm_(&arm), config_(config) {
  set_period(period_s);
  start(arm.start_rad());
}

void LinkMotion::set_period(double period_s) noexcept {
  period_s_ = period_s;
  delay_.design(config_.force_age_s, period_s);
}

void LinkMotion::start(const JointVector& resting_rad) noexcept {
  resting_rad_ = delayed_rad_ = angle_rad_ = resting_rad;
  speed_ = acceleration_ = JointVector::Zero(resting_rad.size());
  delay_.reset(speed_);
}

// Returns M − Jᵀ M_h J. With the twist (v, ω) of T, the part behind the sensor has the momentum m(v − c × ω), and about
// T the angular momentum m c × v + I ω.
JointMatrix LinkMotion::mass(const models::ToolKinematics& at) const noexcept {
  JointMatrix M = arm_->link_mass_matrix(at.q_rad);
  const models::ToolInertia& h = config_.behind_sensor;
  const Mat3 R = at.X_WT.linear(), I = R * h.about_T_kg_m2 * R.transpose();
  const Vec3 c = R * h.centre_T_m;
  for (Eigen::Index j = 0; j < M.cols(); ++j) {
    const Vec3 v = at.J_W.col(j).head<3>(), omega = at.J_W.col(j).tail<3>();
    const Vec3 momentum = h.mass_kg * (v - c.cross(omega));
    const Vec3 spin = h.mass_kg * c.cross(v) + I * omega;
    for (Eigen::Index i = 0; i < M.rows(); ++i) {
      M(i, j) -= at.J_W.col(i).head<3>().dot(momentum) + at.J_W.col(i).tail<3>().dot(spin);
    }
  }
  return M;
}

ToolMove LinkMotion::step(const JointVector& resting_rad, const models::Wrench& wrench_W) noexcept {
  if (!resting_rad.allFinite() || !wrench_W.force.allFinite() || !wrench_W.torque.allFinite()) return {};
  const double T = period_s_;
  const JointVector moved = delay_.step(resting_rad - resting_rad_);
  resting_rad_ = resting_rad;
  delayed_rad_ += moved;
  models::ToolKinematics at;
  arm_->kinematics(angle_rad_, at);
  JointMatrix A = mass(at);
  A.diagonal() += 0.5 * T * config_.damping + 0.25 * T * T * config_.stiffness;
  const JointVector angle = angle_rad_ + T * speed_ + 0.25 * T * T * acceleration_;
  const JointVector speed = speed_ + 0.5 * T * acceleration_;
  const JointVector torque =
      config_.stiffness.cwiseProduct(delayed_rad_ - angle) + config_.damping.cwiseProduct(moved / T - speed) +
      at.J_W.topRows<3>().transpose() * wrench_W.force + at.J_W.bottomRows<3>().transpose() * wrench_W.torque;
  acceleration_ = models::solve_positive_definite(A, JointMatrix(torque));
  speed_ = speed + 0.5 * T * acceleration_;
  const JointVector reached = angle + 0.25 * T * T * acceleration_;
  const ToolMove move{.links_W = at.J_W * (reached - angle_rad_), .motors_W = at.J_W * moved};
  angle_rad_ = reached;
  return move;
}

void LinkMotion::archive(fieldbus::StateArchive& state) noexcept {
  state(delay_.s1, delay_.s2, resting_rad_, delayed_rad_, angle_rad_, speed_, acceleration_);
}

}  // namespace proxarm::controller
