// The directions in which an arm's tool can go: a line, a plane or all of W.
#pragma once

#include "models/arm/arm.hpp"

namespace proxarm::models {

// The smallest linear space that holds the velocities of T in all poses within the joints' ranges. Of an arm with
// fewer axes than dimensions, T keeps to a curve or a curved surface in it.
struct ToolSpace {
  int dimensions = 3;            // 0: T never moves
  Mat3 axes = Mat3::Identity();  // orthonormal; the first `dimensions` columns span it

  [[nodiscard]] Mat3 projection() const noexcept {
    return axes.leftCols(dimensions).lazyProduct(axes.leftCols(dimensions).transpose());
  }
};

// What leaves the space by less than a thousandth of the tool's largest motion counts as a rounded number in the URDF.
// For set-up.
ToolSpace tool_space(const Arm& arm);

// The index-th of poses that are spread evenly over the joints' ranges (Halton's sequence).
JointVector spread_pose(const Arm& arm, int index);

}  // namespace proxarm::models
