// Computes how deep two convex bodies overlap, or how large a gap a plane leaves between them. It is used for reports,
// at the start of a session and to test the result of a step; 𝒢 itself doesn't let bodies overlap.
#pragma once

#include <array>

#include "models/rigid_shapes/solid.hpp"

namespace proxarm::models {

// Returns the largest gap that a plane leaves between the hulls of the points of a and b. The planes that are tried are
// the faces of both solids and the planes along an edge of each. If the gap is negative, the hulls overlap, and its
// absolute value is the length of the shortest way out. If it is positive, it is at most their distance. As soon as a
// plane leaves more than `enough`, the search ends and returns the gap of this plane, which may not be the largest. `X`
// transforms from the frame of a to the frame of b. Precondition: a or b has faces.
double separation_of_hulls(const Solid& a, const Pose& X, const Solid& b, double enough = 0.0) noexcept;

// The plane that leaves the largest gap between two bodies. `normal` is a unit vector from the first body towards the
// second, in the frame of the second.
struct Separation {
  double gap = 0.0;
  Vec3 normal;
};
// Returns the separation of a solid and a triangle, as separation_of_hulls() does. Below 0, the shortest way out may
// lead past the triangle's nearest side. So it is the way out of a surface of triangles only if the solid has entered
// the surface by less than the triangles' size. Precondition: the solid has faces and no radius.
Separation separation_from_triangle(const Solid& a, const Pose& X, const std::array<Vec3, 3>& triangle,
                                    double enough = 0.0) noexcept;

// Returns the largest gap that a plane leaves between two triangles, as separation_of_hulls() does.
double separation_of_triangles(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b) noexcept;

// Returns the distance of a segment from a triangle; 0 if they intersect.
double distance_of_segment(const Vec3& from, const Vec3& to, const std::array<Vec3, 3>& triangle) noexcept;

}  // namespace proxarm::models
