// How much of its drives' torque (drives[].max_torque_Nm) the arm's own weight takes.
//
// Where that is more than a step near full stretch may ask for (drive_torques.hpp), next to nothing is left to
// accelerate and brake with: the arm is slow there. A session can say so before it begins.
#pragma once

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

// Of the drive from which the largest share is taken. Nm; N of an axis that slides.
struct HeldWeight {
  int axis = -1;  // -1: the cell rates no drive
  double weight_Nm = 0.0, rated_Nm = 0.0;
  [[nodiscard]] double share() const noexcept { return axis < 0 ? 0.0 : weight_Nm / rated_Nm; }
};

// In this pose; the cell's tool is on the arm.
HeldWeight held_weight(const models::Arm& arm, const description::Cell& cell, const models::JointVector& q);
// The most within the joints' ranges and the workspace: poses spread over them, and from the heaviest ones on joint by
// joint uphill. Some milliseconds.
HeldWeight heaviest_weight(const models::Arm& arm, const description::Cell& cell);

}  // namespace proxarm::controller
