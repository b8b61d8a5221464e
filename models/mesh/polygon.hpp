// Splits polygons into triangles by ear clipping.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Appends the n − 2 triangles of a polygon of n ≥ 3 corners, each counter-clockwise as the polygon is. Corners are
// looked at from the front of Newell's normal (M. E. Newell's sum of cross products, which bent polygons have, too);
// they may be convex or not, and the outline may touch itself, as that of a polygon with a hole does which is joined to
// its border by a seam. Returns false where the outline crosses itself (or has no area): then it is a fan.
// Costs n² in time, n³ where every ear is the last one tried.
bool triangulate(std::span<const Vec3> vertices, std::span<const std::uint32_t> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace proxarm::models
