// The convex hull of points, exact: as polygons of points that are in one plane to the last bit. What a scanner or a
// file of seven digits leaves of a flat side becomes several faces that are nearly in one plane.
#pragma once

#include <cstdint>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Of each face its corners, counter-clockwise from outside. None: the points are in one plane. Precondition: each
// coordinate is zero or between 1e-60 and 1e60 in magnitude, and no point is there twice.
std::vector<std::vector<std::uint32_t>> faces_of_hull(const std::vector<Vec3>& points);

}  // namespace proxarm::models
