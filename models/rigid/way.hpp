// Describes the way of a step from q(k−1) to p̂, divided into parts.
#pragma once

#include "models/rigid_bodies/rigid_bodies.hpp"

namespace proxarm::models {

struct Way {
  const ToolPose &p_hat, &q_old;
  double far_m = 0.0;  // upper bound of the motion of the tool's points relative to the objects in the step, m
  int parts = 1;

  [[nodiscard]] double each_m() const noexcept { return far_m / parts; }
  [[nodiscard]] double share(int part) const noexcept { return static_cast<double>(part) / parts; }
  // Returns p̂ of a part. Precondition: the objects are at their places at the end of the part.
  [[nodiscard]] ToolPose goal(const RigidBodies& bodies, int part) const noexcept {
    return part == parts ? p_hat : bodies.goal_at(p_hat, q_old, share(part));
  }
};

}  // namespace proxarm::models
