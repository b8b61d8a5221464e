// Computes a lower bound of the distance between the tool and the objects. It compares whole bodies, so no pairs of
// features are needed.
#pragma once

#include "models/rigid/rigid_state.hpp"

namespace proxarm::models {

// Returns a lower bound of the distance between the tool at a pose and all objects that are close, m; at most
// `enough_m`; 0 if the tool may touch an object. The cost of the search is subtracted from `looks_left`.
[[nodiscard]] double free_room_m(const RigidState& state, const ToolPose& pose, double enough_m,
                                 int& looks_left) noexcept;

}  // namespace proxarm::models
