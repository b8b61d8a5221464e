// Finds where a tool ends in a given direction.
#pragma once

#include "models/geometry/geometry.hpp"
#include "models/rigid_shapes/tool.hpp"

namespace proxarm::models {

// Returns the point of a tool that is furthest along `direction` (a unit vector). Throws as solid_of() does.
// Precondition: the tool has a part.
Vec3 furthest_of(const Tool& tool, const Vec3& direction);

}  // namespace proxarm::models
