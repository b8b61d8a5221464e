#include "controller/arm_step/place_margin.hpp"

#include <algorithm>
#include <cmath>

#include "models/geometry/eigenvalues.hpp"

namespace proxarm::controller {

using models::JointVector;
using models::Mat3;
using models::Vec3;

namespace {

constexpr double least_m_per_rad = 0.05, share_of_start = 0.5;
// The gradient of a σ is computed if σ is below the border plus this. A tool at 0.5 m/s takes 0.2 s from such a σ to
// the border.
constexpr double near_m_per_rad = 0.1;
// Change of an angle for finite differences of J_w. J_w is exact to 1e-16 m, so truncation and rounding each change
// ∂J_w/∂c by a millionth.
constexpr double nudge_rad = 1e-6;
// Axes count as meeting in the wrist if they pass it within this distance. A right angle is rounded in a URDF, by
// 1e-9 rad.
constexpr double meeting_m = 1e-6;
// Damping of J_R3⁺, rad/rad: if the sine of the wrist's middle angle is smaller than this, the tool turns later. With
// 0.03, σ changed so fast at small angles that its border moved the tool against the hand.
constexpr double damped_at = 0.3;

// Returns the Jacobian of the tool's point whose position from T is from_T_W.
PlaceMargin::Columns jacobian_of(const models::ToolKinematics& at, const Vec3& from_T_W) noexcept {
  PlaceMargin::Columns J = at.J_W.topRows<3>();
  for (Eigen::Index i = 0; i < J.cols(); ++i) J.col(i) += Vec3(at.J_W.col(i).tail<3>()).cross(from_T_W);
  return J;
}

}  // namespace

PlaceMargin::PlaceMargin(const models::Arm& arm, const models::ToolSpace& space)
    : arm_(&arm), space_(space), weights_(arm.axes()) {
  for (Border& border : borders_) border.gradient = JointVector::Zero(arm.axes());
  const models::JointMatrix C = arm.path_curvature();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) weights_[i] = C.row(i).norm();
  const auto axes = static_cast<std::size_t>(arm.axes());
  wrist_ = axes >= 6 ? axes - 2 : axes;
  for (std::size_t k = 0; k < axes; ++k) {
    carries_[static_cast<std::size_t>(arm.drive_along_chain(k))] = axes < 6 || k + 3 < axes;
  }
  models::ToolKinematics at;
  arm.kinematics(arm.start_rad(), at);
  apart_ = axes >= 6 && !axes_meet(at);
  least_ = std::min(least_m_per_rad, share_of_start * singular(wrist(at).J_W).value[0]);
  near_below_ = least_ + near_m_per_rad;
  from_rad_ = arm.start_rad();
}

bool PlaceMargin::axes_meet(const models::ToolKinematics& at) const noexcept {
  const Columns J = jacobian_of(at, at.joint_W[wrist_] - at.X_WT.translation());
  for (Eigen::Index i = 0; i < J.cols(); ++i) {
    if (!carries(i) && J.col(i).norm() > meeting_m) return false;
  }
  return true;
}

PlaceMargin::Wrist PlaceMargin::wrist(const models::ToolKinematics& at) const noexcept {
  Wrist out{.J_W = at.J_W.topRows<3>(), .from_T_W = Vec3::Zero()};
  if (wrist_ == static_cast<std::size_t>(at.J_W.cols())) return out;
  out.from_T_W = at.joint_W[wrist_] - at.X_WT.translation();
  out.J_W = jacobian_of(at, out.from_T_W);
  if (apart_) hold_orientation(at, out);
  for (Eigen::Index i = 0; i < out.J_W.cols(); ++i) {
    if (!carries(i)) out.J_W.col(i).setZero();
  }
  return out;
}

void PlaceMargin::hold_orientation(const models::ToolKinematics& at, Wrist& wrist) const noexcept {
  Mat3 J_3, J_R3;
  Eigen::Index k = 0;
  for (Eigen::Index i = 0; i < at.J_W.cols(); ++i) {
    if (carries(i)) continue;
    J_3.col(k) = wrist.J_W.col(i);
    J_R3.col(k++) = at.J_W.col(i).tail<3>();
  }
  const Mat3 squared = J_R3 * J_R3.transpose() + damped_at * damped_at * Mat3::Identity();
  wrist.by_turning_W = J_3 * J_R3.transpose() * squared.inverse();
  for (Eigen::Index i = 0; i < at.J_W.cols(); ++i) {
    if (carries(i)) wrist.J_W.col(i) -= wrist.by_turning_W * at.J_W.col(i).tail<3>();
  }
}

PlaceMargin::Singular PlaceMargin::singular(const Columns& J) const noexcept {
  // In directions in which T can't move, J = 0. A large value is added in these directions, so that the smallest values
  // are those of the other directions.
  models::Mat6 squared = models::Mat6::Identity() * 1e6;
  squared.topLeftCorner<3, 3>() = J * J.transpose();
  for (int k = space_.dimensions; k < 3; ++k) {
    squared.topLeftCorner<3, 3>() += 1e6 * space_.axes.col(k) * space_.axes.col(k).transpose();
  }
  const models::SymmetricEigen eigen = models::symmetric_eigen(squared);
  return {eigen.values.head<3>().cwiseMax(0.0).cwiseSqrt(), eigen.vectors.topLeftCorner<3, 3>()};
}

// Whether σ is surely far from the border. The squares λ₁ ≤ λ₂ ≤ λ₃ of the singular values satisfy
//   λ₁ ≥ λ₁λ₂λ₃ / ((λ₁ + λ₂ + λ₃)/2)²
bool PlaceMargin::surely_clear(const Columns& J) const noexcept {
  const Mat3 squared = J * J.transpose();
  const double half_sum = 0.5 * squared.trace();
  return squared.determinant() >= near_below_ * near_below_ * half_sum * half_sum;
}

void PlaceMargin::go_to(const JointVector& c_rad, const models::ToolKinematics& at) noexcept {
  if (apart_) {
    const Columns J = wrist(at).J_W;
    if (surely_clear(J)) {
      near_ = 0;
    } else {
      measure(c_rad, J);
    }
    return;
  }
  const double moved = weights_.dot((c_rad - from_rad_).cwiseAbs());
  if (moved <= clear_) return;
  measure(c_rad, wrist(at).J_W);
}

// Computes every σ near the border, and its gradient: dσ = leftᵀ dJ right, right = Jᵀ left / σ. Two kinds of joints
// don't change σ: the first joint, which moves the arm as a whole, and the joints from the wrist on if their axes meet.
void PlaceMargin::measure(const JointVector& c_rad, const Columns& J) noexcept {
  const Singular now = singular(J);
  from_rad_ = c_rad;
  near_ = 0;
  std::array<JointVector, 3> right;
  for (int k = 0; k < 3 && now.value[k] < near_below_; ++k) {
    const JointVector along = J.transpose() * now.left.col(k);
    right[near_] = now.value[k] > 0.0 ? JointVector(along / now.value[k]) : JointVector::Zero(J.cols());
    borders_[near_++].value = now.value[k];
  }
  clear_ = near_ > 0 ? -1.0 : now.value[0] - near_below_;
  if (near_ == 0) return;
  models::ToolKinematics beside;
  const std::size_t last = apart_ ? static_cast<std::size_t>(c_rad.size()) : wrist_;
  for (std::size_t k = 1; k < last; ++k) {
    const int i = arm_->drive_along_chain(k);
    JointVector c = c_rad;
    c[i] += nudge_rad;
    arm_->kinematics(c, beside);
    const Columns change = wrist(beside).J_W - J;
    for (std::size_t b = 0; b < near_; ++b) {
      borders_[b].gradient[i] = now.left.col(static_cast<int>(b)).dot(change * right[b]) / nudge_rad;
    }
  }
}

}  // namespace proxarm::controller
