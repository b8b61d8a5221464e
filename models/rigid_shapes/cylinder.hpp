// How near the features of a cylinder with flat ends are to those of another body: its side, its ends and its rims.
//
//   side, end       smooth: no point of the other body may come into them, so its points and edges are asked, where
//                   their foot lies on the side or the end
//   rim, face       the rim's lowest point over the face, or four where it is nearly level
//   rim, edge       where the rim comes nearest to the edge's line. A sharp one holds only in the directions between
//                   the normals beside it, and the rim between its side and its end
//   rim, round      the distance less the radius
//
// All in one frame, in which the other body stands as it is described.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/rigid_shapes/touch.hpp"

namespace proxarm::models {

struct Cylinder {
  Vec3 from = Vec3::Zero(), axis = Vec3::UnitZ();  // unit
  double length = 0.0, radius = 0.0;
  std::array<Solid::Rim, 2> rims;

  // From the plane of an end, outwards.
  [[nodiscard]] double before_end(std::uint32_t end, const Vec3& p) const noexcept {
    const double along = axis.dot(p - from);
    return end == 0 ? -along : along - length;
  }
  [[nodiscard]] Vec3 out_of_end(std::uint32_t end) const noexcept { return end == 0 ? Vec3(-axis) : axis; }
};

// Below this sine an edge lies along a rim: what is beside it decides.
inline constexpr double kAlong = 1e-7;

// Precondition: the solid has two rims.
Cylinder cylinder_of(const Solid& solid) noexcept;
Cylinder moved(const Cylinder& cylinder, const Mat3& R, const Vec3& x) noexcept;
EdgeLine axis_of(const Cylinder& cylinder) noexcept;

// A place where the two come near.
struct Meeting {
  Vec3 on_cylinder = Vec3::Zero(), on_other = Vec3::Zero();
  Vec3 out = Vec3::UnitZ();  // unit, from the cylinder towards the other body
  double gap = 0.0;
};

// `radius` is the other body's. `beside` as in touch.hpp.
std::optional<Meeting> meet_side(const Cylinder& cylinder, const Vec3& p, double radius, double beside) noexcept;
std::optional<Meeting> meet_side(const Cylinder& cylinder, const EdgeLine& edge, double radius, double beside) noexcept;
std::optional<Meeting> meet_end(const Cylinder& cylinder, std::uint32_t end, const Vec3& p, double radius,
                                double beside) noexcept;
// Of a point with a radius, that is before the end and beside the side.
std::optional<Meeting> meet_rim(const Cylinder& cylinder, std::uint32_t end, const Vec3& p, double radius) noexcept;
// The nearest first. Returns their number, two at most.
int meet_rim(const Cylinder& cylinder, std::uint32_t end, const EdgeLine& edge, double radius, double beside,
             std::array<Meeting, 2>& out) noexcept;

// From an edge's line out of the rim, at the place that is nearest to one in the rim's u and v, wherever on the line
// and whatever is beside it. NaN where the edge lies along the rim.
double height_of_rim(const Cylinder& cylinder, std::uint32_t end, const EdgeLine& edge, const Vec2& place) noexcept;

// Where a rim comes nearest to the line through y along the unit vector d, in its u and v, the nearest first; two at
// most.
int nearest_to_line(const Solid::Rim& rim, const Vec3& y, const Vec3& d, std::array<Vec2, 2>& out) noexcept;
// Whether a direction out of a rim lies between those out of the side and out of the end.
bool out_of_rim(const Vec3& out, const Vec3& beside, const Vec3& before) noexcept;

// How far a body goes along a unit direction.
double reach_along(const Cylinder& cylinder, const Vec3& n) noexcept;
double extent_along(const Solid& solid, const Vec3& n) noexcept;

// A plane between a cylinder and a convex solid: the largest gap that one leaves, below 0 where they overlap, and then
// the shortest way out. Above 0 it is their distance or less. Precondition: the solid has points.
double separation_of_cylinder(const Cylinder& cylinder, const Solid& other) noexcept;
double separation_of_cylinder(const Cylinder& cylinder, const std::array<Vec3, 3>& triangle) noexcept;

}  // namespace proxarm::models
