// Finds the directions in which an arm's tool can move: a line, a plane or all of W.
#pragma once

#include "models/arm/arm.hpp"

namespace proxarm::models {

// The smallest linear space that contains the velocities of T in all poses within the joints' ranges. If an arm has
// fewer axes than this space has dimensions, T can only move on a curve or a curved surface.
struct ToolSpace {
  int dimensions = 3;            // 0: T never moves
  Mat3 axes = Mat3::Identity();  // orthonormal; the first `dimensions` columns span the space

  [[nodiscard]] Mat3 projection() const noexcept {
    return axes.leftCols(dimensions).lazyProduct(axes.leftCols(dimensions).transpose());
  }
};

// Returns the space of an arm. Motions out of the space that are smaller than a thousandth of the tool's largest motion
// count as rounding in the URDF. For set-up, not for the cycle.
ToolSpace tool_space(const Arm& arm);

// Returns the pose with number `index` of a sequence that covers the joints' ranges evenly (Halton's sequence).
JointVector spread_pose(const Arm& arm, int index);

}  // namespace proxarm::models
