// Computes the share of the drives' torque (drives[].max_torque_Nm) that the arm's own weight takes.
//
// If the share exceeds what a step near full stretch may use (drive_torques.hpp), almost no torque is left to
// accelerate and brake, and the arm is slow there. A session can report this before it begins.
#pragma once

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

// The drive with the largest share. Nm; N for a prismatic axis.
struct HeldWeight {
  int axis = -1;  // -1: the cell rates no drive
  double weight_Nm = 0.0, rated_Nm = 0.0;
  [[nodiscard]] double share() const noexcept { return axis < 0 ? 0.0 : weight_Nm / rated_Nm; }
};

// In this pose, with the cell's tool.
HeldWeight held_weight(const models::Arm& arm, const description::Cell& cell, const models::JointVector& q);
// The maximum within joint ranges and workspace: samples poses, then improves the heaviest joint by joint. Takes some
// milliseconds.
HeldWeight heaviest_weight(const models::Arm& arm, const description::Cell& cell);

}  // namespace proxarm::controller
