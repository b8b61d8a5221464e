// How deep two convex solids are in each other, for figures and for the start of a session; 𝒢 never lets them.
#pragma once

#include <array>

#include "models/rigid_shapes/solid.hpp"

namespace proxarm::models {

// The largest gap that a plane leaves between the hulls of their points, over the planes that may leave the largest:
// the faces of both, and those along an edge of each. Below 0 the hulls overlap, and this is the shortest way, turned
// negative, by which one gets out of the other. Above 0 it is their distance or less. A plane that leaves more than
// `enough` ends the search: nothing larger is told then. `X` leads from the frame of `a` to that of `b`. Precondition:
// one of them has faces.
double separation_of_hulls(const Solid& a, const Pose& X, const Solid& b, double enough = 0.0) noexcept;

// The plane that leaves the largest gap, by its unit normal away from the first body, in the frame of the second.
struct Separation {
  double gap = 0.0;
  Vec3 normal;
};
// The same of a solid with faces, without a radius, and a triangle. It counts from the triangle's nearest side, so it
// is the way out of a surface that the solid went in by less than the triangles' size.
Separation separation_from_triangle(const Solid& a, const Pose& X, const std::array<Vec3, 3>& triangle,
                                    double enough = 0.0) noexcept;

// The same of two triangles.
double separation_of_triangles(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b) noexcept;

// The distance of a segment from a triangle; 0 where they meet.
double distance_of_segment(const Vec3& from, const Vec3& to, const std::array<Vec3, 3>& triangle) noexcept;

}  // namespace proxarm::models
