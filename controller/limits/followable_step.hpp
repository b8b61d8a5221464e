// Defines the interface of the set of places around q₁ that the arm can reach in one step. A step must also keep the
// sets of step_limits.hpp.
//
// The set is the image of the joints' limits and has no closed form. A solver for the nearest point of all sets
// therefore asks whether the arm can reach the found point. If not, the solver adds a half-space that contains all
// reachable places (Kelley's cutting planes), and solves again. The half-space touches the set at the set's point
// nearest to the found point, so one half-space is usually enough.
#pragma once

#include "controller/limits/step_limits.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class FollowableStep {
 public:
  FollowableStep() = default;
  FollowableStep(const FollowableStep&) = delete;
  FollowableStep& operator=(const FollowableStep&) = delete;
  virtual ~FollowableStep() = default;

  // Whether the arm can reach q_W within this step, by its exact kinematics.
  [[nodiscard]] virtual bool contains(const models::Vec3& q_W) noexcept = 0;
  // Whether the arm can't reach q_W, by its kinematics linearised around this step. If so, sets `out` to a half-space,
  // relative to q_k1_W, that contains all reachable places but not q_W; the half-space's `limits` are the joints'
  // limits that form it.
  [[nodiscard]] virtual bool cut(const models::Vec3& q_W, const models::Vec3& q_k1_W, LimitPlane<3>& out) noexcept = 0;
};

}  // namespace proxarm::controller
