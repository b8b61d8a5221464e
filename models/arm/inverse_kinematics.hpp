// Joint angles for a pose of the tool, each cycle, from where the joints are.
//
// Newton's method on e(q) = (p_d − p(q), log(R_d R(q)ᵀ)) with the geometric Jacobian J of T, both in W:
//   J(q) Δq = e(q),  q ← q + Δq
// It converges quadratically: in a cycle the target moves by a fraction of a millimetre, and two or three steps end
// below 1e-12 m and 1e-12 rad. Where Newton's step would leave the joint step limit (near a singularity a small motion
// of the tool may ask for a large one of the joints), damped steps take over,
//   Δq = Jᵀ (J Jᵀ + λ² E)⁻¹ e
// with the smallest λ that keeps within the limit: the tool lags in the direction that is being lost, and only there.
//
// Rotations count with a length: rows 3..5 of e and J are multiplied by config.length_m, so that all singular values
// are in m/rad.
//
// That is of six axes. Others take steps of prioritized_step.hpp instead of Newton's:
//   fewer   reach the place of T alone, in the space in which T can move (tool_space.hpp), and turn the tool
//           towards the wanted orientation as far as is possible meanwhile (least squares of log(R_d Rᵀ))
//   seven   and more reach the whole pose. What is left to them, the elbow's way around, goes towards the posture
//           that set_posture() gave and away from the ends of the joints' ranges, by
//             g = −posture_share [(q − q_posture) + p(q)]
//           p is 0 in the middle 70 % of a joint's range, and grows with the square from there to the whole range
//           at its ends. So the elbow's way is determined by the tool's, and the elbow comes back with it.
// Turning back and the elbow's way take a tenth of each joint's step at most, in the first of a call's steps.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/arm/arm.hpp"
#include "models/arm/prioritized_step.hpp"
#include "models/arm/tool_space.hpp"

namespace proxarm::models {

struct InverseKinematicsConfig {
  // Largest change of each joint in a call, rad. It is never exceeded, apart from rounding in the angle's last place.
  std::array<double, max_axes> max_step_rad{0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01};
  double length_m = 0.5;  // weighs rotation against translation: about the reach of the wrist and tool
  double position_tolerance_m = 1e-12;
  double rotation_tolerance_rad = 1e-12;
  double singular_m_per_rad = 0.01;  // smallest singular value below which a miss is called singular: a joint would
                                     // turn at 1 rad/s for 10 mm/s at the tool
  int max_iterations = 8;            // of Newton
  int max_damped_iterations = 4;
  double posture_share = 0.002;  // a call: at 1 kHz the elbow follows in half a second

  void validate() const;  // throws description::SetupError
};

struct InverseKinematicsResult {
  enum class Status : std::uint8_t {
    converged,      // residuals within tolerance, joints within the step limit
    limited,        // the step limit stopped the joints short of the target; the next call goes on from there
    singular,       // likewise, near a singularity
    not_converged,  // the target can't be reached from here (out of reach), or only through a longer way
    invalid,        // angles or target not finite or not a pose: q is what came in
  };

  Status status = Status::invalid;
  bool out_of_range = false;  // some joint is outside the cell's range_rad; nothing is done about it here
  int iterations = 0;         // all in all
  JointVector q;              // rad
  double position_residual_m = 0.0;
  double rotation_residual_rad = 0.0;
  double smallest_singular_value_m_per_rad = 0.0;  // of the weighted J near q; an estimate, within 10 % where small
  Vec<6> lost_direction_W = Vec<6>::Zero();        // unit vector of weighted motion (v, length·ω) that costs most
  ToolKinematics kinematics;                       // at q
};

class InverseKinematics {
 public:
  // The arm is referred to and must live as long. Throws description::SetupError for an arm whose tool can't go
  // straight in any direction: with fewer axes than the dimensions of its space.
  explicit InverseKinematics(const Arm& arm, const InverseKinematicsConfig& config = {});

  // The hot path: no allocation, no exception; bounded work. `q` are the last angles commanded.
  void solve(const JointVector& q, const Pose& X_WT, InverseKinematicsResult& result) const noexcept;

  // For set-up: angles within the cell's ranges for a pose, from anywhere. Of the solutions found, starting at q_near
  // and then all over the ranges (the same places each time), the one nearest to q_near; none if none is found.
  [[nodiscard]] std::optional<JointVector> solve_anywhere(const Pose& X_WT, const JointVector& q_near) const;

  // Positive and finite, as the configuration's.
  void set_max_step(const std::array<double, max_axes>& max_step_rad) noexcept;
  [[nodiscard]] const InverseKinematicsConfig& config() const noexcept { return config_; }

  // What arms with axes to spare keep to: the angles at the start, until others are given. Of six axes, nothing.
  void set_posture(const JointVector& q) noexcept { posture_ = q; }
  [[nodiscard]] JointVector& posture() noexcept { return posture_; }
  // The place and orientation, or the place alone in this space.
  [[nodiscard]] bool reaches_orientation() const noexcept { return arm_.axes() >= 6; }
  [[nodiscard]] const ToolSpace& space() const noexcept { return space_; }

 private:
  using Vec6 = Vec<6>;
  // The weighted Jacobian of what is reached: six rows, those of what isn't empty.
  template <int Axes>
  using TaskJacobian = Eigen::Matrix<double, 6, Axes, Eigen::ColMajor, 6, Axes == 6 ? 6 : max_axes>;
  template <int Axes>
  using Angles = Eigen::Matrix<double, Axes, 1, Eigen::ColMajor, Axes == 6 ? 6 : max_axes, 1>;

  [[nodiscard]] Vec6 error(const Pose& X_WT, InverseKinematicsResult& result) const noexcept;
  [[nodiscard]] Vec6 task_error(Vec6 error, InverseKinematicsResult& result) const noexcept;
  template <int Axes>
  [[nodiscard]] TaskJacobian<Axes> task_jacobian(const ToolKinematics& kinematics) const noexcept;
  [[nodiscard]] bool arrived(const InverseKinematicsResult& result) const noexcept;
  [[nodiscard]] bool newton(const Vec6& q0, const Pose& X_WT, InverseKinematicsResult& result) const noexcept;
  [[nodiscard]] bool by_priority(const JointVector& q0, const Pose& X_WT,
                                 InverseKinematicsResult& result) const noexcept;
  [[nodiscard]] bool within_step(const JointVector& q, const JointVector& q0) const noexcept;
  [[nodiscard]] JointVector next_angles(const JointVector& q0, const Vec6& pose_error, const Vec6& e, bool with_rest,
                                        const InverseKinematicsResult& result) const noexcept;
  [[nodiscard]] PrioritizedStep step_for(const Vec6& pose_error, const Vec6& e, double weight,
                                         const InverseKinematicsResult& result) const noexcept;
  [[nodiscard]] JointVector towards_posture(const JointVector& q) const noexcept;
  template <int Axes>
  void damped(const Angles<Axes>& q0, const Angles<Axes>& box, int iterations, const Pose& X_WT,
              InverseKinematicsResult& result) const noexcept;
  template <int Axes>
  void solve_for(const JointVector& q, const Pose& X_WT, InverseKinematicsResult& result) const noexcept;
  void finish(InverseKinematicsResult& result) const noexcept;

  const Arm& arm_;
  InverseKinematicsConfig config_;
  Vec6 max_step_;               // of six axes
  JointVector other_max_step_;  // of another number
  ToolSpace space_;
  Mat3 projection_;  // onto it
  int lost_row_;     // which of six ascending singular values is the smallest of what is reached
  JointVector posture_;
};

}  // namespace proxarm::models
