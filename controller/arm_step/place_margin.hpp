// Measures how far the arm is from poses in which the tool can't move in every direction: the arm is stretched or
// folded (elbow), or the wrist is above the first axis (shoulder).
//
//   σ(c) = a singular value of J_w(c), in m/rad
// J_w: Jacobian of the wrist's position by the joints that carry the wrist. With a held orientation, T moves with the
// wrist, so the smallest σ is the tool's motion per joint angle in its slowest direction. Each σ has its own border:
// near two singularities at once, both borders must bound the step, and the smallest σ may be another one in the next
// step. The wrist is the origin of the last joint but one; the last three joints turn the tool about the wrist. For
// arms with fewer than six axes, J_w is T's Jacobian in the directions in which T can move (tool_space.hpp).
//
// If the last three axes don't meet in a point, as in many light arms, these joints also move the wrist when they turn
// the tool. To hold the orientation, they turn by −J_R3⁺ times the rotation by the other joints, so
//   J_w = J_c − P J_Rc,   P = J_3 J_R3⁺
// J: Jacobian of the tool's point at the wrist's origin. Index c: columns of the joints that carry the wrist. Index 3:
// columns of the last three joints. Index R: rows of the rotation. J_R3⁺: inverse of J_R3, damped below a singular
// value of 0.3 rad/rad.
//
// A singularity of the wrist doesn't affect σ: near it, turning lags and the place is kept (arm_step.hpp).
//
// σ changes by at most |ΔJ_w| ≤ Σ_k w_k |Δc_k|, w_k² = Σ_j C_kj² (C: Arm::path_curvature()). So far from the border σ
// isn't computed in each step. If the last three axes don't meet, P may change fast, and a lower bound of σ, from a
// determinant, is computed in each step. Nothing allocates, locks or throws after construction.
#pragma once

#include <array>
#include <span>

#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"

namespace proxarm::controller {

class PlaceMargin {
 public:
  // Precondition: `arm` outlives this object.
  PlaceMargin(const models::Arm& arm, const models::ToolSpace& space);

  // The border, the smallest σ to which a step may lead: 0.05 m/rad, or half of σ at the start pose if this half is
  // smaller. In the default cell, the elbow is then 8° from straight, 4 mm before the end of its reach.
  [[nodiscard]] double least() const noexcept { return least_; }

  // Moves from the last link angles to c_rad. Precondition: `at` is the kinematics at c_rad.
  void go_to(const models::JointVector& c_rad, const models::ToolKinematics& at) noexcept;
  struct Border {
    double value = 0.0;            // σ, m/rad
    models::JointVector gradient;  // gradient of σ by the joints, m/rad²
  };
  // The σ that are near enough to the border to bound a step, smallest first.
  [[nodiscard]] std::span<const Border> near() const noexcept { return {borders_.data(), near_}; }

  // Whether this drive's joint carries the wrist. The other joints only turn the tool about the wrist.
  [[nodiscard]] bool carries(Eigen::Index joint) const noexcept { return carries_[static_cast<std::size_t>(joint)]; }
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, models::max_axes>;
  struct Wrist {
    Columns J_W;            // J_w
    models::Vec3 from_T_W;  // position of the wrist from T
    // P: gives the wrist's motion, if multiplied by the rotation by which the last three joints turn the tool.
    models::Mat3 by_turning_W = models::Mat3::Zero();
  };
  [[nodiscard]] Wrist wrist(const models::ToolKinematics& at) const noexcept;
  // Returns the smallest σ at these kinematics, in m/rad. Changes no state.
  [[nodiscard]] double smallest(const models::ToolKinematics& at) const noexcept {
    return singular(wrist(at).J_W).value[0];
  }

 private:
  // Singular values of J, smallest first, and their left singular vectors.
  struct Singular {
    models::Vec3 value;
    models::Mat3 left;
  };

  [[nodiscard]] Singular singular(const Columns& J) const noexcept;
  void measure(const models::JointVector& c_rad, const Columns& J) noexcept;
  [[nodiscard]] bool axes_meet(const models::ToolKinematics& at) const noexcept;
  void hold_orientation(const models::ToolKinematics& at, Wrist& wrist) const noexcept;
  [[nodiscard]] bool surely_clear(const Columns& J) const noexcept;

  const models::Arm* arm_;
  models::ToolSpace space_;
  models::JointVector weights_;  // w
  std::array<bool, models::max_axes> carries_{};
  std::size_t wrist_ = 0;  // index of the joint whose origin is the wrist; axes(): T is used as the wrist
  bool apart_ = false;     // the last three axes don't meet in the wrist
  double least_ = 0.0, near_below_ = 0.0;
  models::JointVector from_rad_;
  double clear_ = -1.0;
  std::array<Border, 3> borders_;
  std::size_t near_ = 0;
};

}  // namespace proxarm::controller
