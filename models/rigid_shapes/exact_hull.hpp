// Computes the convex hull of points exactly: its faces are polygons of points that lie in one plane to the last bit. A
// flat side that was scanned, or read from a file with seven digits, therefore becomes several faces that lie nearly in
// one plane.
#pragma once

#include <cstdint>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Returns the corners of each face, counter-clockwise as seen from outside; empty if all points lie in one plane.
// Preconditions: each coordinate is zero or between 1e-60 and 1e60 in magnitude, and no two points are equal.
std::vector<std::vector<std::uint32_t>> faces_of_hull(const std::vector<Vec3>& points);

}  // namespace proxarm::models
