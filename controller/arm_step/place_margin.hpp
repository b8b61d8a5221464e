// Measures how far the arm is from poses in which the tool can't move in every direction: stretched or folded (elbow),
// or with the wrist above the first axis (shoulder).
//
//   σ(c) = a singular value of J_w(c), in m/rad
// J_w: Jacobian of the wrist's position by the joints that carry it. With the orientation held, T moves with the wrist,
// so the smallest σ is the tool's motion per joint angle in its slowest direction. Each σ has its own border: near two
// singularities at once, both must end the step, and which σ is smallest may change between steps. The wrist is the
// origin of the last joint but one; the last three joints turn the tool about it. For arms with fewer than six axes,
// J_w is T's Jacobian in the directions in which T can move (tool_space.hpp).
//
// If the last three axes don't meet in a point, as in many light arms, turning the tool back also moves it. To hold the
// orientation, the last three joints turn by −J_R⁺ times the turning by the others, so
//   J_w = J_c − P J_Rc,   P = J_3 J_R3⁺
// J: of the tool's point at the wrist's origin; c: the joints that carry it, 3: the last three, R: rotations; J_R3⁺:
// the inverse, damped to σ = 0.3 rad/rad.
//
// A singularity of the wrist itself doesn't affect σ: there, turning lags and the place is kept (arm_step.hpp).
//
// σ changes by at most |ΔJ_w| ≤ Σ_k w_k |Δc_k|, w_k² = Σ_j C_kj² (C: Arm::path_curvature()), so it isn't computed in
// each step far from the border. With P, which may change fast, a lower bound from a determinant is. No allocation,
// lock or throw after construction.
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

  // Smallest σ that a step may lead to: 0.05 m/rad (elbow of the default cell 8° from straight, 4 mm of its reach), or
  // half of σ at the start pose if that is less.
  [[nodiscard]] double least() const noexcept { return least_; }

  // Moves from the last link angles to c_rad. Precondition: `at` is the kinematics at c_rad.
  void go_to(const models::JointVector& c_rad, const models::ToolKinematics& at) noexcept;
  struct Border {
    double value = 0.0;            // σ, m/rad
    models::JointVector gradient;  // of σ by the joints, m/rad²
  };
  // The σ so near their border that a step might matter, smallest first.
  [[nodiscard]] std::span<const Border> near() const noexcept { return {borders_.data(), near_}; }

  // Whether this drive's joint carries the wrist; the others only turn the tool about it.
  [[nodiscard]] bool carries(Eigen::Index joint) const noexcept { return carries_[static_cast<std::size_t>(joint)]; }
  // J_w and the wrist's position.
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, models::max_axes>;
  struct Wrist {
    Columns J_W;
    models::Vec3 from_T_W;  // from T to the wrist
    models::Mat3 by_turning_W =
        models::Mat3::Zero();  // P: motion of the wrist when the last three joints turn the tool
  };
  [[nodiscard]] Wrist wrist(const models::ToolKinematics& at) const noexcept;
  // The smallest σ there, in m/rad; keeps no state.
  [[nodiscard]] double smallest(const models::ToolKinematics& at) const noexcept {
    return singular(wrist(at).J_W).value[0];
  }

 private:
  // Singular values of J, smallest first, and their left vectors.
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
  std::size_t wrist_ = 0;  // index of the joint whose origin is the wrist; axes(): T
  bool apart_ = false;     // the last three axes don't meet there
  double least_ = 0.0, near_below_ = 0.0;
  models::JointVector from_rad_;
  double clear_ = -1.0;
  std::array<Border, 3> borders_;
  std::size_t near_ = 0;
};

}  // namespace proxarm::controller
