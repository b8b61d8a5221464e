// Checks whether the rendered point stays within workspace_m and out of keep_out_m between two poses of the motors.
#pragma once

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::identification {

[[nodiscard]] bool free_path(const description::Cell& cell, const models::Arm& arm, const models::JointVector& from,
                             const models::JointVector& to);

}  // namespace proxarm::identification
