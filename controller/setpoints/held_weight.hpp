// How much of its drives' torque (drives[].max_torque_Nm) the arm's own weight takes.
//
// Where that is more than setpoints may ask for (torque_share.hpp), the tool's guard has next to nothing left to
// accelerate and brake with: near full stretch the tool lags behind its proxy, and stands some millimetres in what that
// touches. A session can say so before it begins.
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
