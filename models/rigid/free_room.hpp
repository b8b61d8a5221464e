// How far the tool is from all that it may meet, at least: from whole bodies, where no pairs of features are gathered.
#pragma once

#include "models/rigid/rigid_state.hpp"

namespace proxarm::models {

// Lower bound of the distance between the tool and all objects that are close, at a pose, m; 0 if they may touch. The
// search ends at `enough_m`. Its cost is taken from `looks_left`.
[[nodiscard]] double free_room_m(const RigidState& state, const ToolPose& pose, double enough_m,
                                 int& looks_left) noexcept;

}  // namespace proxarm::models
