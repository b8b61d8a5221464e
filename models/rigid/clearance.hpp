// Computes the distance between the tool and the objects, from the gaps of all features and from whole bodies.
#pragma once

#include "models/rigid/rigid_state.hpp"

namespace proxarm::models {

// Returns the smallest signed gap between the tool at a pose and all objects that are close, m. Changes `state`.
[[nodiscard]] double least_gap_m(RigidState& state, const ToolPose& pose) noexcept;

}  // namespace proxarm::models
