// How far the arm is from the poses in which its place is lost: stretched or folded (elbow), or with its wrist above
// its first axis (shoulder).
//
//   σ(c) = a singular value of J_w(c), in m/rad
// J_w: the Jacobian of the wrist's place, by the joints that carry it. With the orientation held, T goes where the
// wrist goes, so the smallest σ is what the slowest direction of the tool has of a joint's turn. Each of them has a
// border of its own: where an arm comes near to two singularities at once, the one that is further off ends the step,
// too, and which of them is the smallest may change from step to step. The wrist is the origin of the last
// joint but one, and the last three joints turn the tool about it. An arm with fewer than six axes has no such wrist:
// there J_w is that of T in the directions in which T can go (tool_space.hpp).
//
// Where the last three axes don't meet in one point, as in many light arms, turning the tool back moves it, too. With
// the orientation held, the last three joints turn by −J_R⁺ of what the others turn the tool by, so
//   J_w = J_c − P J_Rc,   P = J_3 J_R3⁺
// J: of the point of the tool that is at the wrist's origin; c: the joints that carry it, 3: the last three, R: their
// rotations, and J_R3⁺ the inverse, damped to σ = 0.3 rad/rad.
//
// A wrist's own singularity doesn't show in σ: there, turning lags and the place is kept (arm_step.hpp).
//
// σ changes by at most |ΔJ_w| ≤ Σ_k w_k |Δc_k|, w_k² = Σ_j C_kj² (C: Arm::path_curvature()), so far from the border it
// isn't computed in every step (with P, which may change fast, a lower bound of it is: from a determinant). Neither
// allocates, locks nor throws after construction.
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

  // The least σ that a step may lead to: 0.05 m/rad (an elbow of the default cell 8° from straight, which is 4 mm of
  // its reach), and half of σ at the start's pose where that is less.
  [[nodiscard]] double least() const noexcept { return least_; }

  // The links have gone on from the last angles that were told to c_rad. Precondition: `at` is the kinematics at c_rad.
  void go_to(const models::JointVector& c_rad, const models::ToolKinematics& at) noexcept;
  struct Border {
    double value = 0.0;            // σ, m/rad
    models::JointVector gradient;  // of σ by the joints, m/rad²
  };
  // The σ that are so near to their border that a step might matter, the smallest first.
  [[nodiscard]] std::span<const Border> near() const noexcept { return {borders_.data(), near_}; }

  // Whether the joint of this drive carries the wrist; the others only turn the tool about it.
  [[nodiscard]] bool carries(Eigen::Index joint) const noexcept { return carries_[static_cast<std::size_t>(joint)]; }
  // J_w, and the wrist's place.
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, models::max_axes>;
  struct Wrist {
    Columns J_W;
    models::Vec3 from_T_W;  // from T to the wrist
    models::Mat3 by_turning_W =
        models::Mat3::Zero();  // P: how the wrist moves when the last three joints turn the tool
  };
  [[nodiscard]] Wrist wrist(const models::ToolKinematics& at) const noexcept;
  // The smallest σ there, m/rad, of an arm that may be anywhere.
  [[nodiscard]] double smallest(const models::ToolKinematics& at) const noexcept {
    return singular(wrist(at).J_W).value[0];
  }

 private:
  // Of J: values from the smallest on, and their left vectors.
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
  std::size_t wrist_ = 0;  // index of the joint whose origin is the wrist; axes(): T itself
  bool apart_ = false;     // the last three axes don't meet there
  double least_ = 0.0, near_below_ = 0.0;
  models::JointVector from_rad_;
  double clear_ = -1.0;
  std::array<Border, 3> borders_;
  std::size_t near_ = 0;
};

}  // namespace proxarm::controller
