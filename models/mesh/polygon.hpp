// Splits polygons into triangles by ear clipping.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Appends the n − 2 triangles of a polygon with n ≥ 3 corners. Each triangle is counter-clockwise about Newell's
// normal, as the polygon is (M. E. Newell's sum of cross products, which is also defined for bent polygons). The
// polygon needn't be convex, and its outline may touch itself: a seam may join a hole to the border. Returns false if
// the outline crosses itself or has no area; the triangles are then a fan. Takes time n², or n³ if every ear is found
// last.
bool triangulate(std::span<const Vec3> vertices, std::span<const std::uint32_t> corners,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace proxarm::models
