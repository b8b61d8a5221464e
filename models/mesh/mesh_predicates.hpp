// Exact geometric predicates: on which side of a plane a point is, and whether a segment touches a triangle.
//
// Only these predicates ensure that nothing passes a mesh: computed heights decide where the proxy goes, but never
// whether it may go there. A determinant is first evaluated in doubles, with an error bound (J. R. Shewchuk, "Adaptive
// precision floating-point arithmetic and fast robust geometric predicates", Discrete & Computational Geometry 18,
// 1997). If the error bound leaves the sign open, the determinant is evaluated as an exact sum of doubles.
//
// Precondition: the magnitude of each coordinate is zero or between 1e-60 and 1e60. Otherwise products under- or
// overflow.
#pragma once

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Returns the sign (−1, 0, 1) of det[b − a, c − a, x − a]: 1 if x is in front of the triangle a b c (on the side from
// which a b c is counter-clockwise), 0 if x is in the triangle's plane.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) noexcept;

// Whether the three points are on a line, or two of them are equal.
bool collinear(const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

// Whether the closed segment from x to y has a point in common with the closed triangle. Precondition: a, b and c
// aren't collinear.
bool segment_touches_triangle(const Vec3& x, const Vec3& y, const Vec3& a, const Vec3& b, const Vec3& c) noexcept;
// Does the same test if the sides of x and y, orientation(a, b, c, ·), are already known.
bool segment_touches_triangle(const Vec3& x, const Vec3& y, int side_x, int side_y, const Vec3& a, const Vec3& b,
                              const Vec3& c) noexcept;

}  // namespace proxarm::models
