// The steps that the arm can follow, as a set of places around q₁ beside those of step_limits.hpp.
//
// It has no closed form: it is the image of the joints' limits. It is therefore asked for, one half-space at a time:
// whoever looks for the nearest point of all sets asks whether a point can be followed, and if it can't, takes in a
// half-space that contains all steps that can (Kelley's cutting planes). The half-space touches the set where it is
// nearest to that point, so one is usually enough.
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

  // Whether the arm can go to q_W within this step, by its exact kinematics.
  [[nodiscard]] virtual bool contains(const models::Vec3& q_W) noexcept = 0;
  // If the arm can't go to q_W, by its kinematics linearised around this step: returns true and the half-space around
  // q₁_W that contains all places it can go to, and not q_W. Its `limit` has the bits of all limits that form it.
  [[nodiscard]] virtual bool cut(const models::Vec3& q_W, const models::Vec3& q_k1_W, LimitPlane<3>& out) noexcept = 0;
};

}  // namespace proxarm::controller
