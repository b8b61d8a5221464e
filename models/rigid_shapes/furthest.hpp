// Where a tool ends in a direction.
#pragma once

#include "models/geometry/geometry.hpp"
#include "models/rigid_shapes/tool.hpp"

namespace proxarm::models {

// The place of a tool that is furthest along a direction (unit). Throws as solid_of(). Precondition: it has a part.
Vec3 furthest_of(const Tool& tool, const Vec3& direction);

}  // namespace proxarm::models
