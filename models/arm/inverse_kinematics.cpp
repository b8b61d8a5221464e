#include "models/arm/inverse_kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "models/arm/prioritized_step.hpp"
#include "models/base/setup_error.hpp"
#include "models/geometry/eigenvalues.hpp"
#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {
namespace {

using Vec6 = Vec<6>;
using Status = InverseKinematicsResult::Status;

// rest_share: the part of a joint's step limit that is for turning the tool back and for the null space.
//
// end_share: the part of a joint's range that counts as near an end.
constexpr double rest_share = 0.1, end_share = 0.15;
// Lowest weight of the tool's rotation against the joints' rotations. With a lower weight, the orientation isn't held.
constexpr double least_turning_weight = 1e-3;

// Returns the logarithm of a rotation as a rotation vector, |·| ≤ π. It is computed from the quaternion, whose vector
// part is exact to rounding for small angles.
Vec3 rotation_vector(const Mat3& R) noexcept {
  Eigen::Quaterniond r(R);
  if (r.w() < 0.0) r.coeffs() = -r.coeffs();
  const double s = r.vec().norm();
  if (s < 1e-8) return 2.0 * r.vec();  // 2 asin(s)/s = 2 (1 + s²/6 …), which is 2 in double precision
  return (2.0 * std::atan2(s, r.w()) / s) * r.vec();
}

// Computes the smallest singular value and its left vector, by the power method on J⁻¹, starting from the largest row
// of J⁻¹. The convergence factor is the squared ratio of the two smallest singular values, so the result is accurate
// near singularities.
void smallest_singular_value(const Mat6& inverse, double& sigma, Vec6& direction) noexcept {
  Eigen::Index row = 0;
  inverse.rowwise().squaredNorm().maxCoeff(&row);
  Vec6 u = inverse.row(row).transpose();
  double gain = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double length = u.norm();
    if (!(length > 0.0) || !std::isfinite(length)) break;
    u /= length;
    const Vec6 v = inverse * u;
    gain = v.norm();
    direction = u;
    u.noalias() = inverse.transpose() * v;
  }
  sigma = gain > 0.0 && std::isfinite(gain) ? 1.0 / gain : 0.0;
}

void require_straight_ways(const Arm& arm, const ToolSpace& space) {
  if (space.dimensions > 0 && arm.axes() >= space.dimensions) return;
  const std::string axes = std::to_string(arm.axes()) + (arm.axes() == 1 ? " axis" : " axes");
  const char* way = space.dimensions == 0 ? ", and a tool that they don't move"
                    : arm.axes() == 1     ? ", which leads the tool along a curve"
                                          : ", which lead the tool over a curved surface";
  throw description::SetupError(
      {.file = arm.file(),
       .key = "drives",
       .found = axes + way,
       .expected = "a tool that can go straight: along a line, in a plane or in space",
       .advice = "one axis must slide, two may both slide or turn about parallel axes, three or more reach any place"});
}

bool is_pose(const Pose& X) noexcept {
  const Mat3 R = X.linear();
  // Products of poses deviate from orthonormal by far less than 1e-6, and a deviation of 1e-6 wouldn't affect the
  // solution.
  return X.matrix().allFinite() && (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
         R.determinant() > 0.0;
}

}  // namespace

void InverseKinematicsConfig::validate() const {
  const auto check = [](const char* key, double value, double max) {
    if (std::isfinite(value) && value > 0.0 && value <= max) return;
    throw description::SetupError({.key = key,
                                   .found = description::number_text(value),
                                   .expected = "a number above 0 and at most " + description::number_text(max)});
  };
  for (const double step : max_step_rad) check("max_step_rad", step, 10.0);
  check("length_m", length_m, 100.0);
  check("position_tolerance_m", position_tolerance_m, 1.0);
  check("rotation_tolerance_rad", rotation_tolerance_rad, 1.0);
  check("singular_m_per_rad", singular_m_per_rad, 1.0);
  check("posture_share", posture_share, 1.0);
  check("max_iterations", max_iterations, 1000);
  check("max_damped_iterations", max_damped_iterations, 1000);
}

InverseKinematics::InverseKinematics(const Arm& arm, const InverseKinematicsConfig& config)
    : arm_(arm),
      config_(config),
      space_(reaches_orientation() ? ToolSpace{} : tool_space(arm)),
      projection_(space_.projection()),
      lost_row_(reaches_orientation() ? 0 : 6 - space_.dimensions),
      posture_(arm.start_rad()) {
  config.validate();
  require_straight_ways(arm, space_);
  set_max_step(config.max_step_rad);
}

void InverseKinematics::set_max_step(const std::array<double, max_axes>& max_step_rad) noexcept {
  config_.max_step_rad = max_step_rad;
  max_step_ = Eigen::Map<const Vec6>(config_.max_step_rad.data());
  other_max_step_ = Eigen::Map<const JointVector>(config_.max_step_rad.data(), arm_.axes());
}

// Updates kinematics and residuals at result.q. Returns the weighted error of the pose.
InverseKinematics::Vec6 InverseKinematics::error(const Pose& X_WT, InverseKinematicsResult& result) const noexcept {
  const JointVector& known = result.kinematics.q_rad;
  if (known.size() != result.q.size() || known != result.q) arm_.kinematics(result.q, result.kinematics);
  const Pose& X = result.kinematics.X_WT;
  const Vec3 e_p = X_WT.translation() - X.translation();
  const Vec3 e_R = rotation_vector(X_WT.linear() * X.linear().transpose());
  result.position_residual_m = e_p.norm();
  result.rotation_residual_rad = e_R.norm();
  Vec6 e;
  e.head<3>() = e_p;
  e.tail<3>() = config_.length_m * e_R;
  return e;
}

// Returns the part of the error that the arm can correct: the whole error, or the position error in the tool's space.
InverseKinematics::Vec6 InverseKinematics::task_error(Vec6 error, InverseKinematicsResult& result) const noexcept {
  if (reaches_orientation()) return error;
  const Vec3 e_p = projection_.lazyProduct(error.head<3>());
  result.position_residual_m = e_p.norm();
  error << e_p, Vec3::Zero();
  return error;
}

template <int Axes>
InverseKinematics::TaskJacobian<Axes> InverseKinematics::task_jacobian(
    const ToolKinematics& kinematics) const noexcept {
  TaskJacobian<Axes> J = kinematics.J_W.leftCols<Axes>(arm_.axes());
  J.template bottomRows<3>() *= config_.length_m;
  if (Axes != 6 && !reaches_orientation()) {
    J.template topRows<3>() = projection_.lazyProduct(kinematics.J_W.topRows<3>());
    J.template bottomRows<3>().setZero();
  }
  return J;
}

bool InverseKinematics::arrived(const InverseKinematicsResult& result) const noexcept {
  return result.position_residual_m <= config_.position_tolerance_m &&
         (result.rotation_residual_rad <= config_.rotation_tolerance_rad || !reaches_orientation());
}

// Runs Newton's method. Returns true if it ended within the tolerances and the step limit; otherwise result.q is the
// last iterate.
bool InverseKinematics::newton(const Vec6& q0, const Pose& X_WT, InverseKinematicsResult& result) const noexcept {
  Vec6 e = error(X_WT, result);
  FactoredMatrix J;
  for (int i = 0;; ++i) {
    const bool there = result.position_residual_m <= config_.position_tolerance_m &&
                       result.rotation_residual_rad <= config_.rotation_tolerance_rad;
    if (there) return true;
    if (i == config_.max_iterations) return false;
    J.factor(task_jacobian<6>(result.kinematics));
    const Vec6 q = result.q + J.solve(e);
    // This form of the condition also refuses NaN and infinity, which a singular J gives.
    if (!(((q - q0).array().abs() <= max_step_.array()).all())) return false;
    result.q = q;
    ++result.iterations;
    e = error(X_WT, result);
  }
}

// Does what newton() does, for arms with other numbers of axes. The first step includes motion in the null space, even
// if the tool stands still. This motion bends the task's path slightly, and the next steps correct the path.
bool InverseKinematics::by_priority(const JointVector& q0, const Pose& X_WT,
                                    InverseKinematicsResult& result) const noexcept {
  Vec6 pose_error = error(X_WT, result), e = task_error(pose_error, result);
  for (int i = 0; i == 0 || !arrived(result); ++i) {
    if (i == config_.max_iterations) return false;
    const JointVector q = next_angles(q0, pose_error, e, i == 0, result);
    if (!within_step(q, q0)) return false;
    result.q = q;
    ++result.iterations;
    pose_error = error(X_WT, result);
    e = task_error(pose_error, result);
  }
  return true;
}

void InverseKinematics::measure_singularity(InverseKinematicsResult& result) const noexcept {
  if (arm_.axes() == 6) {
    FactoredMatrix J;
    J.factor(task_jacobian<6>(result.kinematics));
    return smallest_singular_value(J.inverse(), result.smallest_singular_value_m_per_rad, result.lost_direction_W);
  }
  const TaskJacobian<Eigen::Dynamic> J = task_jacobian<Eigen::Dynamic>(result.kinematics);
  const SymmetricEigen eigen = symmetric_eigen(J.lazyProduct(J.transpose()));
  result.smallest_singular_value_m_per_rad = std::sqrt(std::max(0.0, eigen.values[lost_row_]));
  result.lost_direction_W = eigen.vectors.col(lost_row_);
}

// This form of the condition counts NaN and infinity, which a singular J gives, as outside.
bool InverseKinematics::within_step(const JointVector& q, const JointVector& q0) const noexcept {
  return ((q - q0).array().abs() <= other_max_step_.array()).all();
}

// Returns the angles after the task's step, plus as much motion in the null space as the limit allows. If holding the
// orientation would exceed the limit (for a stretched wrist), the orientation's weight is reduced in several steps.
JointVector InverseKinematics::next_angles(const JointVector& q0, const Vec6& pose_error, const Vec6& e, bool with_rest,
                                           const InverseKinematicsResult& result) const noexcept {
  PrioritizedStep step;
  for (double weight = turning_weight; weight > least_turning_weight; weight *= 0.25) {
    step = step_for(pose_error, e, weight, result);
    if (reaches_orientation() || within_step(result.q + step.task, q0)) break;
  }
  const JointVector q = result.q + step.task;
  const double most = (step.rest.array().abs() / other_max_step_.array()).maxCoeff();
  if (!with_rest || !(most > 0.0)) return q;
  const JointVector rested = q + std::min(1.0, rest_share / most) * step.rest;
  return within_step(rested, q0) ? rested : q;
}

PrioritizedStep InverseKinematics::step_for(const Vec6& pose_error, const Vec6& e, double weight,
                                            const InverseKinematicsResult& result) const noexcept {
  const TaskJacobian<Eigen::Dynamic> J = task_jacobian<Eigen::Dynamic>(result.kinematics);
  const JointVector posture = towards_posture(result.q);
  if (reaches_orientation()) {
    return prioritized_step(J, e, JointMatrix::Identity(arm_.axes(), arm_.axes()), posture);
  }
  const auto U = space_.axes.leftCols(space_.dimensions);
  const Vec3 e_R = pose_error.tail<3>() / config_.length_m;
  const JointVector turn = weight * result.kinematics.J_W.bottomRows<3>().transpose().lazyProduct(e_R);
  return prioritized_step(U.transpose().lazyProduct(J.topRows<3>()), U.transpose().lazyProduct(e.head<3>()),
                          turning_cost(result.kinematics.J_W, weight), turn + posture);
}

JointVector InverseKinematics::towards_posture(const JointVector& q) const noexcept {
  JointVector g = q - posture_;
  for (int i = 0; i < arm_.axes(); ++i) {
    const double range = arm_.upper_rad()[i] - arm_.lower_rad()[i], margin = end_share * range;
    const double above = std::max(0.0, (q[i] - arm_.upper_rad()[i]) / margin + 1.0);
    const double below = std::max(0.0, (arm_.lower_rad()[i] - q[i]) / margin + 1.0);
    g[i] += range * (above * above - below * below);
  }
  return -config_.posture_share * g;
}

// Takes damped steps within ±box of q0. Each step uses the least damping with which the step stays within this box, and
// brings the tool nearer to the target by at least a quarter of the distance that J predicts. If the tool gets less
// near, the kinematics are too nonlinear for this step.
template <int Axes>
void InverseKinematics::damped(const Angles<Axes>& q0, const Angles<Axes>& box, int iterations, const Pose& X_WT,
                               InverseKinematicsResult& result) const noexcept {
  const auto refreshed_error = [&] {
    const Vec6 of_pose = error(X_WT, result);
    return Axes == 6 ? of_pose : task_error(of_pose, result);
  };
  Vec6 e = refreshed_error();
  for (int i = 0; i < iterations; ++i) {
    if (arrived(result)) break;
    // J Jᵀ = U S U ᵀ with S = σ², so Δq = Jᵀ U (S + λ²)⁻¹ Uᵀ e.
    const TaskJacobian<Axes> J = task_jacobian<Axes>(result.kinematics);
    const SymmetricEigen eigen = symmetric_eigen(J.lazyProduct(J.transpose()));
    const Vec6 squares = eigen.values.cwiseMax(0.0);
    const Mat6& U = eigen.vectors;
    const Vec6 projected = U.transpose() * e;
    result.smallest_singular_value_m_per_rad = std::sqrt(squares[lost_row_]);
    result.lost_direction_W = U.col(lost_row_);
    ++result.iterations;

    const Angles<Axes> q_before = result.q;
    const double before = e.norm();
    constexpr double quarter = 0.25;
    // Values of σ below 1e-8 σ_max are rounding errors of J Jᵀ. The values tried for λ begin at 1e-8 σ_max and end far
    // above σ_max, where steps are tiny.
    double lambda2 = 1e-16 * squares[5];
    bool nearer = false;
    for (int rung = 0; rung < 24 && !nearer; ++rung, lambda2 *= 8.0) {
      const Vec6 damping = (squares.array() + lambda2).inverse().matrix();
      const Angles<Axes> q = q_before + J.transpose() * (U * projected.cwiseProduct(damping));
      if (!(((q - q0).array().abs() <= box.array()).all())) continue;
      result.q = q;
      const Vec6 e_new = refreshed_error();
      const double promised = before - lambda2 * projected.cwiseProduct(damping).norm();
      nearer = before - e_new.norm() > quarter * promised;
      if (nearer) e = e_new;
    }
    if (!nearer) {
      result.q = q_before;
      e = refreshed_error();
      break;
    }
  }
}

void InverseKinematics::finish(InverseKinematicsResult& result) const noexcept {
  result.out_of_range = false;
  for (int i = 0; i < arm_.axes(); ++i) {
    result.out_of_range = result.out_of_range || result.q[i] < arm_.lower_rad()[i] || result.q[i] > arm_.upper_rad()[i];
  }
}

void InverseKinematics::solve(const JointVector& q, const Pose& X_WT, InverseKinematicsResult& result) const noexcept {
  result.q = q;
  result.iterations = 0;
  if (q.size() != arm_.axes() || !q.allFinite() || !is_pose(X_WT)) {
    result.status = Status::invalid;
    return;
  }
  if (arm_.axes() == 6) {
    solve_for<6>(q, X_WT, result);
  } else {
    solve_for<Eigen::Dynamic>(q, X_WT, result);
  }
  finish(result);
}

template <int Axes>
void InverseKinematics::solve_for(const JointVector& q, const Pose& X_WT,
                                  InverseKinematicsResult& result) const noexcept {
  const Angles<Axes> q0 = q;
  Angles<Axes> most;
  bool converged = false;
  if constexpr (Axes == 6) {
    most = max_step_;
    converged = newton(q0, X_WT, result);
  } else {
    most = other_max_step_;
    converged = by_priority(q0, X_WT, result);
  }
  if (converged) {
    result.status = Status::converged;
    return;
  }
  result.q = q;
  damped<Axes>(q0, most, config_.max_damped_iterations, X_WT, result);
  // Whether the step limit stopped the joints: one joint has used more than half of its limit.
  const bool at_limit = ((result.q - q0).array().abs() > 0.5 * most.array()).any();
  result.status = arrived(result)                                                         ? Status::converged
                  : result.smallest_singular_value_m_per_rad < config_.singular_m_per_rad ? Status::singular
                  : at_limit                                                              ? Status::limited
                                                                                          : Status::not_converged;
}

std::optional<JointVector> InverseKinematics::solve_anywhere(const Pose& X_WT, const JointVector& q_near) const {
  if (q_near.size() != arm_.axes() || !q_near.allFinite() || !is_pose(X_WT)) return std::nullopt;
  constexpr int starts = 200, iterations = 60;
  std::optional<JointVector> best;
  double best_distance = 0.0;
  for (int start = 0; start < starts; ++start) {
    InverseKinematicsResult result;
    result.q = q_near;
    if (start > 0) result.q = spread_pose(arm_, start);
    constexpr double anywhere = 20.0;
    if (arm_.axes() == 6) {
      damped<6>(result.q, Vec6::Constant(anywhere), iterations, X_WT, result);
    } else {
      damped<Eigen::Dynamic>(result.q, JointVector::Constant(arm_.axes(), anywhere), iterations, X_WT, result);
    }
    if (!arrived(result)) continue;
    // Full turns don't move the tool, so each joint is turned as near to q_near as its range allows.
    bool inside = true;
    for (int i = 0; i < arm_.axes(); ++i) {
      constexpr double turn = 2.0 * std::numbers::pi;
      double& angle = result.q[i];
      if (!arm_.slides(i)) {
        angle -= turn * std::round((angle - q_near[i]) / turn);
        while (angle > arm_.upper_rad()[i]) angle -= turn;
        while (angle < arm_.lower_rad()[i]) angle += turn;
      }
      inside = inside && angle >= arm_.lower_rad()[i] && angle <= arm_.upper_rad()[i];
    }
    const double distance = (result.q - q_near).cwiseAbs().maxCoeff();
    if (inside && (!best || distance < best_distance)) {
      best = result.q;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace proxarm::models
