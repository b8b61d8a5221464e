// Computes, in each cycle, the joint angles for a pose of the tool, starting from the present joint angles.
//
// The method has two stages:
// 1. Newton's method on e(q) = (p_d − p(q), log(R_d R(q)ᵀ)), with the geometric Jacobian J of T, both in W:
//      J(q) Δq = e(q),  q ← q + Δq
//    It converges quadratically. In a cycle the target moves by a fraction of a millimetre, and after two or three
//    steps the errors are below 1e-12 m and 1e-12 rad.
// 2. Near a singularity, a small motion of the tool may need a large motion of the joints. If Newton's step would
//    exceed the joints' step limit, damped least squares follows (Wampler 1986; Nakamura and Hanafusa 1986):
//      Δq = Jᵀ (J Jᵀ + λ² E)⁻¹ e
//    with the smallest λ that keeps the limit. The tool then lags only in the direction in which the arm becomes
//    singular.
//
// Rotations are weighted by a length: rows 3..5 of e and J are multiplied by config.length_m, so that all singular
// values are in m/rad.
//
// Newton's steps are for six axes. Arms with other numbers of axes take the steps of prioritized_step.hpp:
//   fewer axes  reach only the position of T, in the space in which T can move (tool_space.hpp). Meanwhile
//               they turn the tool as near to the wanted orientation as possible (least squares of log(R_d Rᵀ)).
//   more axes   reach the whole pose. The motion in their null space (the elbow's motion) leads towards the posture of
//               set_posture(), and away from the ends of the joints' ranges, by
//                 g = −posture_share [(q − q_posture) + p(q)]
//               p is 0 in the middle 70 % of a joint's range. From there it grows quadratically to the whole range at
//               the ends of the range. So the tool's path determines the elbow's path; if the tool returns, the elbow
//               returns too.
// Turning the tool back, and motion in the null space, take at most a tenth of each joint's step limit, in the first
// step of a call.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/arm/arm.hpp"
#include "models/arm/prioritized_step.hpp"
#include "models/arm/tool_space.hpp"

namespace proxarm::models {

struct InverseKinematicsConfig {
  // Largest change of each joint in a call, rad. Only rounding can exceed it.
  std::array<double, max_axes> max_step_rad{0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01};
  double length_m = 0.5;  // weight of rotation against translation; about the reach of wrist and tool
  double position_tolerance_m = 1e-12;
  double rotation_tolerance_rad = 1e-12;
  // If the target is missed and the smallest singular value is below this, the miss counts as singular. At this value,
  // a joint turns at 1 rad/s for 10 mm/s at the tool.
  double singular_m_per_rad = 0.01;
  int max_iterations = 8;  // most iterations of Newton's method
  int max_damped_iterations = 4;
  // The fraction per call. At 1 kHz, the elbow follows in half a second.
  double posture_share = 0.002;

  void validate() const;  // throws description::SetupError
};

struct InverseKinematicsResult {
  enum class Status : std::uint8_t {
    converged,      // residuals are within tolerance, and joints within the step limit
    limited,        // the step limit stopped the joints before the target; the next call continues
    singular,       // the joints stopped before the target, near a singularity
    not_converged,  // from the present angles, the target is out of reach, or reachable only by a longer path
    invalid,        // the angles or the target aren't finite, or the target isn't a pose; result.q is then the given q
  };

  Status status = Status::invalid;
  bool out_of_range = false;  // whether a joint is outside the cell's range_rad; it is only reported
  int iterations = 0;         // the iterations of both methods
  JointVector q;              // rad
  double position_residual_m = 0.0;
  double rotation_residual_rad = 0.0;
  ToolKinematics kinematics;  // the kinematics at q
  // Smallest singular value of the weighted J near q: an estimate, within 10 % if the value is small. Set by
  // measure_singularity(), and by solve() if the target is missed.
  double smallest_singular_value_m_per_rad = 0.0;
  // Unit vector of the weighted motion (v, length·ω) in which J is smallest. Set together with the singular value.
  Vec<6> lost_direction_W = Vec<6>::Zero();
};

class InverseKinematics {
 public:
  // Precondition: `arm` outlives this object. Throws description::SetupError if the tool can't move straight in any
  // direction, because the arm has fewer axes than the tool's space has dimensions.
  explicit InverseKinematics(const Arm& arm, const InverseKinematicsConfig& config = {});

  // Solves for the pose X_WT. For the cycle: doesn't allocate or throw, and the work is bounded. Precondition: `q` are
  // the last commanded angles. Reuses result.kinematics if it belongs to q.
  void solve(const JointVector& q, const Pose& X_WT, InverseKinematicsResult& result) const noexcept;

  // Measures how near result.q is to a singularity. Precondition: result.kinematics belongs to result.q.
  void measure_singularity(InverseKinematicsResult& result) const noexcept;

  // Returns joint angles within the cell's ranges for a pose, from any start. Searches from q_near and then from a
  // fixed set of angles all over the ranges. Returns the solution nearest to q_near, or nullopt. For set-up, not for
  // the cycle.
  [[nodiscard]] std::optional<JointVector> solve_anywhere(const Pose& X_WT, const JointVector& q_near) const;

  // Sets InverseKinematicsConfig::max_step_rad. Precondition: the values are positive and finite.
  void set_max_step(const std::array<double, max_axes>& max_step_rad) noexcept;
  [[nodiscard]] const InverseKinematicsConfig& config() const noexcept { return config_; }

  // Sets the posture towards which arms with more than six axes move; by default this is the start's posture. Unused
  // with six axes.
  void set_posture(const JointVector& q) noexcept { posture_ = q; }
  [[nodiscard]] JointVector& posture() noexcept { return posture_; }
  // Whether position and orientation are reached (true), or only the position in space() (false).
  [[nodiscard]] bool reaches_orientation() const noexcept { return arm_.axes() >= 6; }
  [[nodiscard]] const ToolSpace& space() const noexcept { return space_; }

 private:
  using Vec6 = Vec<6>;
  // The weighted Jacobian of the task. It has six rows; rows that aren't part of the task are zero.
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
  Vec6 max_step_;               // step limits for six axes
  JointVector other_max_step_;  // step limits for other numbers of axes
  ToolSpace space_;
  Mat3 projection_;  // projection onto space_
  int lost_row_;     // index of the task's smallest singular value among all singular values in ascending order
  JointVector posture_;
};

}  // namespace proxarm::models
