// Computes how near the features of a cylinder with flat ends are to the features of another body. The cylinder's
// features are its side, its two ends and its two rims:
//
//   side, end           Points and edges of the other body are tested against these smooth surfaces.
//                       A pair counts if the foot lies on the side or the end.
//   rim, face           The rim's lowest point over the face; four points if the rim is nearly level.
//   rim, sharp edge     The place where the rim comes nearest to the edge's line. It counts only if the direction
//                       lies between the normals beside the edge, and between those of the cylinder's side and end.
//   rim, round feature  The distance minus the radius.
//
// All quantities are in the frame in which the other body is described.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/rigid_shapes/touch.hpp"

namespace proxarm::models {

struct Cylinder {
  Vec3 from = Vec3::Zero(), axis = Vec3::UnitZ();  // `axis` is a unit vector
  double length = 0.0, radius = 0.0;
  std::array<Solid::Rim, 2> rims;

  // Returns the distance of p from the plane of an end, positive outside the cylinder.
  [[nodiscard]] double before_end(std::uint32_t end, const Vec3& p) const noexcept {
    const double along = axis.dot(p - from);
    return end == 0 ? -along : along - length;
  }
  [[nodiscard]] Vec3 out_of_end(std::uint32_t end) const noexcept { return end == 0 ? Vec3(-axis) : axis; }
};

// If the sine of the angle between an edge and a rim's tangent is below this, the edge lies along the rim. The features
// beside it then determine the contact.
inline constexpr double kAlong = 1e-7;

// Precondition: the solid has two rims.
Cylinder cylinder_of(const Solid& solid) noexcept;
Cylinder moved(const Cylinder& cylinder, const Mat3& R, const Vec3& x) noexcept;
EdgeLine axis_of(const Cylinder& cylinder) noexcept;

// A place where the cylinder and the other body come near each other.
struct Meeting {
  Vec3 on_cylinder = Vec3::Zero(), on_other = Vec3::Zero();
  Vec3 out = Vec3::UnitZ();  // unit vector from the cylinder towards the other body
  double gap = 0.0;
};

// Return the meeting of the side, or of an end, with a point or an edge; nullopt if the foot isn't on the side or the
// end. An edge also gives nullopt if it is parallel to the axis, or if its crossing gives way to the ends (touch.hpp).
// `radius` is the radius of the other body. `beside` is explained in touch.hpp.
std::optional<Meeting> meet_side(const Cylinder& cylinder, const Vec3& p, double radius, double beside) noexcept;
std::optional<Meeting> meet_side(const Cylinder& cylinder, const EdgeLine& edge, double radius, double beside) noexcept;
std::optional<Meeting> meet_end(const Cylinder& cylinder, std::uint32_t end, const Vec3& p, double radius,
                                double beside) noexcept;
// Returns the meeting of a rim with a point that has a radius; nullopt unless the point is in front of the end and
// outside the side.
std::optional<Meeting> meet_rim(const Cylinder& cylinder, std::uint32_t end, const Vec3& p, double radius) noexcept;
// Finds the meetings of a rim with an edge, the nearest place of the rim first. Returns their number, at most two.
int meet_rim(const Cylinder& cylinder, std::uint32_t end, const EdgeLine& edge, double radius, double beside,
             std::array<Meeting, 2>& out) noexcept;

// Returns the height of an edge's line above a rim, along the direction out of the rim. Of the rim's places that are
// nearest to the line, the one closest to `place` (in the rim's u and v) is used. The height doesn't depend on where
// the edge ends or on what is beside it. NaN if the edge lies along the rim.
double height_of_rim(const Cylinder& cylinder, std::uint32_t end, const EdgeLine& edge, const Vec2& place) noexcept;

// Finds where a rim comes nearest to the line through y along the unit vector d. `out` gets the places in the rim's u
// and v, the nearest first. Returns their number, at most two.
int nearest_to_line(const Solid::Rim& rim, const Vec3& y, const Vec3& d, std::array<Vec2, 2>& out) noexcept;
// True if `out` lies between the directions `beside` (out of the side) and `before` (out of the end) at a place of the
// rim, within askew_rad.
bool out_of_rim(const Vec3& out, const Vec3& beside, const Vec3& before) noexcept;

// Return how far a body reaches along the unit vector n: the largest nᵀx of its points x.
double reach_along(const Cylinder& cylinder, const Vec3& n) noexcept;
double extent_along(const Solid& solid, const Vec3& n) noexcept;

// Return the largest gap that a plane leaves between a cylinder and a convex solid or triangle. If the gap is negative,
// the bodies overlap, and its absolute value is the length of the shortest way out. If it is positive, it is at most
// their distance. Precondition: the solid has points.
double separation_of_cylinder(const Cylinder& cylinder, const Solid& other) noexcept;
double separation_of_cylinder(const Cylinder& cylinder, const std::array<Vec3, 3>& triangle) noexcept;

}  // namespace proxarm::models
