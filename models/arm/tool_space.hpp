// The directions in which an arm's tool can move: a line, a plane or all of W.
#pragma once

#include "models/arm/arm.hpp"

namespace proxarm::models {

// The smallest linear space that contains the velocities of T in all poses within the joints' ranges. If an arm has
// fewer axes than this space has dimensions, T stays on a curve or a curved surface.
struct ToolSpace {
  int dimensions = 3;            // 0: T never moves
  Mat3 axes = Mat3::Identity();  // orthonormal; the first `dimensions` columns span it

  [[nodiscard]] Mat3 projection() const noexcept {
    return axes.leftCols(dimensions).lazyProduct(axes.leftCols(dimensions).transpose());
  }
};

// Motions out of the space below a thousandth of the tool's largest motion are taken as rounding in the URDF. For
// set-up.
ToolSpace tool_space(const Arm& arm);

// Pose number `index` of a sequence that covers the joints' ranges evenly (Halton's sequence).
JointVector spread_pose(const Arm& arm, int index);

}  // namespace proxarm::models
