// The steps that the arm can follow: a set of places around q₁, used beside the sets of step_limits.hpp.
//
// The set is the image of the joints' limits and has no closed form. A solver that looks for the nearest point of all
// sets therefore queries it: if the arm can't reach the found point, it adds a half-space that contains all reachable
// steps (Kelley's cutting planes) and solves again. The half-space touches the set at the point nearest to the query,
// so one cut is usually enough.
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
  // If the arm can't reach q_W, by its kinematics linearised around this step: returns true, and in `out` a half-space
  // around q₁_W that contains all reachable places but not q_W. Its `limits` are those that form it.
  [[nodiscard]] virtual bool cut(const models::Vec3& q_W, const models::Vec3& q_k1_W, LimitPlane<3>& out) noexcept = 0;
};

}  // namespace proxarm::controller
