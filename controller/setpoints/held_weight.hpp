// Computes the share of the drives' torque (drives[].max_torque_Nm) that holds the arm's weight.
//
// If this share exceeds the share that a step near full stretch may use (drive_torques.hpp), almost no torque is left
// to accelerate and brake, and the arm is slow near full stretch. So the session can report the share at its start.
#pragma once

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

// The drive with the largest share. Unit of the torques: Nm; N for a prismatic axis.
struct HeldWeight {
  int axis = -1;  // -1: the cell rates no drive
  double weight_Nm = 0.0, rated_Nm = 0.0;
  [[nodiscard]] double share() const noexcept { return axis < 0 ? 0.0 : weight_Nm / rated_Nm; }
};

// Returns the drive with the largest share in the pose q, with the cell's tool.
HeldWeight held_weight(const models::Arm& arm, const description::Cell& cell, const models::JointVector& q);
// Returns the drive with the largest share of all poses within joint ranges and workspace. Samples poses, then
// increases the share of the pose with the largest share, joint by joint. Takes some milliseconds.
HeldWeight heaviest_weight(const models::Arm& arm, const description::Cell& cell);

}  // namespace proxarm::controller
