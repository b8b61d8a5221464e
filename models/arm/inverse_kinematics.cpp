#include "models/arm/inverse_kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/base/setup_error.hpp"
#include "models/geometry/eigenvalues.hpp"
#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {
namespace {

using Vec6 = Vec<6>;
using Status = InverseKinematicsResult::Status;

// log of a rotation as rotation vector, |·| ≤ π. Through the quaternion, whose vector part is exact to rounding where
// the angle is small.
Vec3 rotation_vector(const Mat3& R) noexcept {
  Eigen::Quaterniond r(R);
  if (r.w() < 0.0) r.coeffs() = -r.coeffs();
  const double s = r.vec().norm();
  if (s < 1e-8) return 2.0 * r.vec();  // 2 asin(s)/s = 2 (1 + s²/6 …): equal in double precision
  return (2.0 * std::atan2(s, r.w()) / s) * r.vec();
}

// The smallest singular value and its left vector from the inverse: the power method on J⁻¹, started with the row that
// is largest. Converges with the square of the ratio of the two smallest, so it is good where it matters.
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

bool is_pose(const Pose& X) noexcept {
  const Mat3 R = X.linear();
  // No product of poses gets as far as 1e-6 from orthonormal, and a deviation of that size doesn't harm the solution
  // yet.
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
  check("max_iterations", max_iterations, 1000);
  check("max_damped_iterations", max_damped_iterations, 1000);
}

InverseKinematics::InverseKinematics(const Arm& arm, const InverseKinematicsConfig& config)
    : arm_(arm), config_(config) {
  config.validate();
  if (arm.axes() != 6) {
    throw description::SetupError({.key = "drives",
                                   .found = std::to_string(arm.axes()) + " axes",
                                   .expected = "six, for position and orientation of the tool"});
  }
  set_max_step(config.max_step_rad);
}

void InverseKinematics::set_max_step(const std::array<double, 6>& max_step_rad) noexcept {
  config_.max_step_rad = max_step_rad;
  max_step_ = Eigen::Map<const Vec6>(config_.max_step_rad.data());
}

// Refreshes kinematics and residuals at result.q; returns the weighted error.
InverseKinematics::Vec6 InverseKinematics::error(const Pose& X_WT, InverseKinematicsResult& result) const noexcept {
  arm_.kinematics(result.q, result.kinematics);
  const Pose& X = result.kinematics.X_WT;
  const Vec3 e_p = X_WT.translation() - X.translation();
  const Vec3 e_R = rotation_vector(X_WT.linear() * X.linear().transpose());
  result.position_residual_m = e_p.norm();
  result.rotation_residual_rad = e_R.norm();
  Vec6 e;
  e << e_p, config_.length_m * e_R;
  return e;
}

Mat6 InverseKinematics::weighted_jacobian(const ToolKinematics& kinematics) const noexcept {
  Mat6 J = kinematics.J_W.leftCols<6>();
  J.bottomRows<3>() *= config_.length_m;
  return J;
}

// Newton's method. True if it ended within tolerance and within the step limit; otherwise result.q is where it stopped.
bool InverseKinematics::newton(const Vec6& q0, const Pose& X_WT, InverseKinematicsResult& result) const noexcept {
  Vec6 e = error(X_WT, result);
  FactoredMatrix J;
  for (int i = 0;; ++i) {
    const bool arrived = result.position_residual_m <= config_.position_tolerance_m &&
                         result.rotation_residual_rad <= config_.rotation_tolerance_rad;
    if (!arrived || i == 0) J.factor(weighted_jacobian(result.kinematics));
    if (arrived) break;
    if (i == config_.max_iterations) return false;
    const Vec6 q = result.q + J.solve(e);
    // Written so that NaN and infinity, from a singular J, end here too.
    if (!(((q - q0).array().abs() <= max_step_.array()).all())) return false;
    result.q = q;
    ++result.iterations;
    e = error(X_WT, result);
  }
  smallest_singular_value(J.inverse(), result.smallest_singular_value_m_per_rad, result.lost_direction_W);
  return true;
}

// Damped steps that stay within ±box of q0. Each takes the least damping with which it stays there and brings the tool
// nearer by at least a quarter of what J predicts (with less, J says little about where the step ends).
void InverseKinematics::damped(const Vec6& q0, const Vec6& box, int iterations, const Pose& X_WT,
                               InverseKinematicsResult& result) const noexcept {
  Vec6 e = error(X_WT, result);
  for (int i = 0; i < iterations; ++i) {
    if (result.position_residual_m <= config_.position_tolerance_m &&
        result.rotation_residual_rad <= config_.rotation_tolerance_rad) {
      break;
    }
    // J Jᵀ = U S U ᵀ with S = σ², so Δq = Jᵀ U (S + λ²)⁻¹ Uᵀ e.
    const Mat6 J = weighted_jacobian(result.kinematics);
    const SymmetricEigen eigen = symmetric_eigen(J * J.transpose());
    const Vec6 squares = eigen.values.cwiseMax(0.0);
    const Mat6& U = eigen.vectors;
    const Vec6 projected = U.transpose() * e;
    result.smallest_singular_value_m_per_rad = std::sqrt(squares[0]);
    result.lost_direction_W = U.col(0);
    ++result.iterations;

    const Vec6 q_before = result.q;
    const double before = e.norm();
    constexpr double quarter = 0.25;
    // σ below 1e-8 σ_max are rounding of J Jᵀ. The ladder reaches from there to far above σ_max, where the step is
    // tiny.
    double lambda2 = 1e-16 * squares[5];
    bool nearer = false;
    for (int rung = 0; rung < 24 && !nearer; ++rung, lambda2 *= 8.0) {
      const Vec6 damping = (squares.array() + lambda2).inverse().matrix();
      const Vec6 q = q_before + J.transpose() * (U * projected.cwiseProduct(damping));
      if (!(((q - q0).array().abs() <= box.array()).all())) continue;
      result.q = q;
      const Vec6 e_new = error(X_WT, result);
      const double promised = before - lambda2 * projected.cwiseProduct(damping).norm();
      nearer = before - e_new.norm() > quarter * promised;
      if (nearer) e = e_new;
    }
    if (!nearer) {
      result.q = q_before;
      e = error(X_WT, result);
      break;
    }
  }
}

void InverseKinematics::finish(InverseKinematicsResult& result) const noexcept {
  result.out_of_range = false;
  for (int i = 0; i < 6; ++i) {
    result.out_of_range = result.out_of_range || result.q[i] < arm_.lower_rad()[i] || result.q[i] > arm_.upper_rad()[i];
  }
}

void InverseKinematics::solve(const JointVector& q, const Pose& X_WT, InverseKinematicsResult& result) const noexcept {
  result.q = q;
  result.iterations = 0;
  if (q.size() != 6 || !q.allFinite() || !is_pose(X_WT)) {
    result.status = Status::invalid;
    return;
  }
  const Vec6 q0 = q;
  if (newton(q0, X_WT, result)) {
    result.status = Status::converged;
  } else {
    result.q = q;
    damped(q0, max_step_, config_.max_damped_iterations, X_WT, result);
    const bool arrived = result.position_residual_m <= config_.position_tolerance_m &&
                         result.rotation_residual_rad <= config_.rotation_tolerance_rad;
    // Stopped by the limit: some joint has used up most of it.
    const bool at_limit = ((result.q - q0).array().abs() > 0.5 * max_step_.array()).any();
    result.status = arrived                                                                 ? Status::converged
                    : result.smallest_singular_value_m_per_rad < config_.singular_m_per_rad ? Status::singular
                    : at_limit                                                              ? Status::limited
                                                                                            : Status::not_converged;
  }
  finish(result);
}

std::optional<JointVector> InverseKinematics::solve_anywhere(const Pose& X_WT, const JointVector& q_near) const {
  if (q_near.size() != 6 || !q_near.allFinite() || !is_pose(X_WT)) return std::nullopt;
  constexpr int starts = 200, iterations = 60;
  constexpr std::array<int, 6> primes{2, 3, 5, 7, 11, 13};
  const auto halton = [](int index, int base) {
    double value = 0.0, digit = 1.0;
    for (; index > 0; index /= base) value += (digit /= base) * (index % base);
    return value;
  };
  std::optional<JointVector> best;
  double best_distance = 0.0;
  for (int start = 0; start < starts; ++start) {
    InverseKinematicsResult result;
    result.q = q_near;
    for (int i = 0; start > 0 && i < 6; ++i) {
      const double share = halton(start, primes[static_cast<std::size_t>(i)]);
      result.q[i] = arm_.lower_rad()[i] + share * (arm_.upper_rad()[i] - arm_.lower_rad()[i]);
    }
    const Vec6 from = result.q;
    damped(from, Vec6::Constant(20.0), iterations, X_WT, result);
    if (result.position_residual_m > config_.position_tolerance_m ||
        result.rotation_residual_rad > config_.rotation_tolerance_rad) {
      continue;
    }
    // Full turns don't move the tool: each joint as near to q_near as its range allows.
    bool inside = true;
    for (int i = 0; i < 6; ++i) {
      constexpr double turn = 2.0 * std::numbers::pi;
      double& angle = result.q[i];
      angle -= turn * std::round((angle - q_near[i]) / turn);
      while (angle > arm_.upper_rad()[i]) angle -= turn;
      while (angle < arm_.lower_rad()[i]) angle += turn;
      inside = inside && angle <= arm_.upper_rad()[i];
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
