// Exact geometric predicates: on which side of a plane is a point, and does a segment touch a triangle?
//
// That nothing passes a mesh rests on these answers alone: computed heights decide where the proxy goes, never whether
// it may. The determinant is first evaluated in doubles, with an error bound (J. R. Shewchuk, "Adaptive precision
// floating-point arithmetic and fast robust geometric predicates", Discrete & Computational Geometry 18, 1997). If that
// leaves the sign open, it is evaluated as an exact sum of doubles.
//
// Precondition: each coordinate is zero or between 1e-60 and 1e60 in magnitude; outside, products under- or overflow.
#pragma once

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// The sign (−1, 0, 1) of det[b − a, c − a, x − a]: 1 if x is in front of the triangle a b c (on the side from which it
// is counter-clockwise), 0 if x is in its plane.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) noexcept;

// True if the three points are on a line or two of them are equal.
bool collinear(const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

// True if the closed segment from x to y has a point in common with the closed triangle. Precondition: the triangle
// isn't collinear.
bool segment_touches_triangle(const Vec3& x, const Vec3& y, const Vec3& a, const Vec3& b, const Vec3& c) noexcept;
// The same with the known sides of x and y, orientation(a, b, c, ·).
bool segment_touches_triangle(const Vec3& x, const Vec3& y, int side_x, int side_y, const Vec3& a, const Vec3& b,
                              const Vec3& c) noexcept;

}  // namespace proxarm::models
