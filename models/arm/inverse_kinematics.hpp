// Joint angles for a pose of the tool in each cycle, starting from the present angles.
//
// Newton's method on e(q) = (p_d − p(q), log(R_d R(q)ᵀ)) with the geometric Jacobian J of T, both in W:
//   J(q) Δq = e(q),  q ← q + Δq
// It converges quadratically: in a cycle the target moves by a fraction of a millimetre, and two or three steps end
// below 1e-12 m and 1e-12 rad. Near a singularity, a small motion of the tool may need a large motion of the joints. If
// Newton's step would exceed the joints' step limit, damped least squares (Wampler 1986; Nakamura and Hanafusa 1986)
// follows,
//   Δq = Jᵀ (J Jᵀ + λ² E)⁻¹ e
// with the smallest λ that keeps the limit. The tool then lags only in the direction that the arm is losing.
//
// Rotations are weighted with a length: rows 3..5 of e and J are multiplied by config.length_m, so that all singular
// values are in m/rad.
//
// Newton's steps are for six axes. Other arms take the steps of prioritized_step.hpp:
//   fewer   reach only the position of T, in the space in which T can move (tool_space.hpp), and meanwhile turn the
//           tool as near to the wanted orientation as possible (least squares of log(R_d Rᵀ))
//   more    reach the whole pose. Their null space (the elbow's motion) leads towards the posture of set_posture()
//           and away from the ends of the joints' ranges, by
//             g = −posture_share [(q − q_posture) + p(q)]
//           p is 0 in the middle 70 % of a joint's range and grows quadratically from there to the whole range at its
//           ends. So the tool's path determines the elbow's path, and both return together.
// Turning the tool back and null-space motion take at most a tenth of each joint's step limit, in a call's first step.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/arm/arm.hpp"
#include "models/arm/prioritized_step.hpp"
#include "models/arm/tool_space.hpp"

namespace proxarm::models {

struct InverseKinematicsConfig {
  // Largest change of each joint in a call, rad; exceeded by rounding at most.
  std::array<double, max_axes> max_step_rad{0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 0.01};
  double length_m = 0.5;  // weight of rotation against translation: about the reach of wrist and tool
  double position_tolerance_m = 1e-12;
  double rotation_tolerance_rad = 1e-12;
  double singular_m_per_rad = 0.01;  // a miss counts as singular if the smallest singular value is below this: a joint
                                     // would turn at 1 rad/s for 10 mm/s at the tool
  int max_iterations = 8;            // of Newton's method
  int max_damped_iterations = 4;
  double posture_share = 0.002;  // in each call: at 1 kHz the elbow follows in half a second

  void validate() const;  // throws description::SetupError
};

struct InverseKinematicsResult {
  enum class Status : std::uint8_t {
    converged,      // residuals within tolerance, joints within the step limit
    limited,        // the step limit stopped the joints short of the target; the next call continues
    singular,       // as limited, near a singularity
    not_converged,  // the target is out of reach from here, or reachable only by a longer way
    invalid,        // angles or target aren't finite or not a pose: q is the input
  };

  Status status = Status::invalid;
  bool out_of_range = false;  // a joint is outside the cell's range_rad; only reported
  int iterations = 0;         // of both methods
  JointVector q;              // rad
  double position_residual_m = 0.0;
  double rotation_residual_rad = 0.0;
  ToolKinematics kinematics;  // at q
  // Set by measure_singularity(), and if the target is missed.
  double smallest_singular_value_m_per_rad = 0.0;  // of the weighted J near q; an estimate, within 10 % if it is small
  Vec<6> lost_direction_W = Vec<6>::Zero();  // unit vector of weighted motion (v, length·ω) in which J is smallest
};

class InverseKinematics {
 public:
  // Precondition: `arm` outlives this object. Throws description::SetupError if the tool can't go straight in any
  // direction, because the arm has fewer axes than its tool's space has dimensions.
  explicit InverseKinematics(const Arm& arm, const InverseKinematicsConfig& config = {});

  // For the cycle: no allocation, no exception, bounded work. Precondition: `q` are the last commanded angles. Reuses
  // result.kinematics if they belong to q.
  void solve(const JointVector& q, const Pose& X_WT, InverseKinematicsResult& result) const noexcept;

  // How near result.q is to a singularity. Precondition: result.kinematics belong to result.q.
  void measure_singularity(InverseKinematicsResult& result) const noexcept;

  // For set-up: angles within the cell's ranges for a pose, from any start. Searches from q_near and then from places
  // all over the ranges (always the same ones). Returns the solution nearest to q_near, or nullopt.
  [[nodiscard]] std::optional<JointVector> solve_anywhere(const Pose& X_WT, const JointVector& q_near) const;

  // Precondition: positive and finite, as in the configuration.
  void set_max_step(const std::array<double, max_axes>& max_step_rad) noexcept;
  [[nodiscard]] const InverseKinematicsConfig& config() const noexcept { return config_; }

  // The posture to which arms with more than six axes tend; the start's by default. Unused with six axes.
  void set_posture(const JointVector& q) noexcept { posture_ = q; }
  [[nodiscard]] JointVector& posture() noexcept { return posture_; }
  // True: position and orientation are reached; false: only the position, in space().
  [[nodiscard]] bool reaches_orientation() const noexcept { return arm_.axes() >= 6; }
  [[nodiscard]] const ToolSpace& space() const noexcept { return space_; }

 private:
  using Vec6 = Vec<6>;
  // The weighted Jacobian of the task: six rows; rows outside of the task are zero.
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
  Vec6 max_step_;               // for six axes
  JointVector other_max_step_;  // for other numbers of axes
  ToolSpace space_;
  Mat3 projection_;  // onto space_
  int lost_row_;     // index of the task's smallest singular value, in ascending order
  JointVector posture_;
};

}  // namespace proxarm::models
