// Computes how near a feature of the tool is to a feature of an object, in the object's frame.
//
// A gap is the distance of the two features along the normal. For small motions it changes by nᵀ(displacement of the
// tool's material point). Every gap that is returned must not become negative, wherever outside the object the tool
// comes from.
//
//   point, face       counts if the foot lies on the face
//   sharp edges       (no radius) count if the nearest points lie inside both edges, and if the direction lies between
//                     the normals of the faces beside the edge, for both solids
//   round features    points and edges with a radius, in any combination: the distance minus both radii
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "models/rigid_shapes/circle.hpp"
#include "models/rigid_shapes/solid.hpp"

namespace proxarm::models {

// How far, in metres, a foot may lie beside a face or beyond an edge's end and still count. It is far above the
// rounding of a point at a metre (1e-16 m), and far below the difference that a gap at a neighbouring feature would
// show.
inline constexpr double beside_m = 1e-10;

struct Touch {
  Vec3 point = Vec3::Zero();    // the touching point of the tool
  Vec3 normal = Vec3::UnitZ();  // unit vector, towards the tool
  double gap = 0.0;
};

// Surfaces of objects that enclose the tool: the object lies behind the surface, and the tool is on the free side. Seen
// from the tool's side, the free space is convex, so only points and rims of the tool can touch these surfaces.
struct FlatSide {
  Vec3 normal = Vec3::UnitZ();
  double offset = 0.0;
};
struct HollowSphere {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;
};
struct HollowTube {  // around a segment, or around a whole line if `endless`
  Vec3 from = Vec3::Zero(), to = Vec3::UnitZ();
  double radius = 0.0;
  bool endless = false;
};

// Return the touch of a point p with a radius.
Touch touch(const FlatSide& side, const Vec3& p, double radius) noexcept;
Touch touch(const HollowSphere& hollow, const Vec3& p, double radius) noexcept;
Touch touch(const HollowTube& hollow, const Vec3& p, double radius) noexcept;

// Find the points of a rim that come nearest to a surface, the nearest first. Return the number of points: one; two if
// a rim lies askew in a tube; four if the rim is nearly level, because then all its points are nearly at the same
// distance. If the rim is level to within rounding, it has no lowest point, and `level` (a unit vector in u and v) is
// used as the place of the first point. A tube counts as endless here.
int nearest_of_rim(const FlatSide& side, const Solid::Rim& rim, const Vec2& level, std::array<Vec3, 4>& out) noexcept;
int nearest_of_rim(const HollowSphere& hollow, const Solid::Rim& rim, const Vec2& level,
                   std::array<Vec3, 4>& out) noexcept;
int nearest_of_rim(const HollowTube& hollow, const Solid::Rim& rim, const Vec2& level,
                   std::array<Vec3, 4>& out) noexcept;
// Returns where the rim's lowest point over a side lies: a unit vector in u and v; zero if the rim is level to within
// rounding.
Vec2 lowest_of_rim(const FlatSide& side, const Solid::Rim& rim) noexcept;

// A segment. If it is a sharp edge, `left` and `right` are the normals of the faces beside it.
struct EdgeLine {
  Vec3 from = Vec3::Zero(), to = Vec3::UnitX();
  Vec3 left = Vec3::Zero(), right = Vec3::Zero();
  // The edge is the border of an open surface: it has a face on one side only, and any direction may count.
  bool open = false;
};

// True if a unit direction across a sharp edge lies between the normals of the edge's faces, within askew_rad.
bool between(const Vec3& n, const Vec3& left, const Vec3& right) noexcept;

// Returns the touch of a point p with a radius over a face; nullopt if the foot isn't on the face. `side` is 1 or −1,
// the side of the face on which the point is.
std::optional<Touch> touch_face(const Vec3& p, double radius, const Vec3& normal, double offset,
                                std::span<const Vec3> points, std::span<const std::uint32_t> ring, double side,
                                double beside = beside_m) noexcept;
// Returns the touch of two points with radii; `radii` is the sum of the radii. Touch::point is `own` itself, without
// the tool's radius.
std::optional<Touch> touch_point(const Vec3& own, const Vec3& other, double radii) noexcept;
// Returns the touch of a point and an edge; nullopt if the point of the edge nearest to p is one of its ends.
// `own_is_edge`: the edge belongs to the tool.
std::optional<Touch> touch_round(const Vec3& p, const EdgeLine& edge, double radii, double own_radius,
                                 bool own_is_edge) noexcept;
// Returns what must be added to the gap at the crossing of two round edges, in metres; nullopt if the crossing doesn't
// count. Two round bodies that nearly lie along each other are nearer at their crossing than at the ends of their
// common length, by the sag sine² both²/(8 radii), where `both` is the common length. There are three cases:
// 1. The sag is negligible: the place of the crossing is arbitrary, and contacts at the ends hold the bodies. The
//    result is nullopt.
// 2. The sag is slightly larger: a small amount is added, so that the crossing gives way to the ends gradually.
// 3. The sag is larger still: nothing is added.
std::optional<double> gives_way_to_ends_m(const EdgeLine& one, const EdgeLine& other, double radii,
                                          double sine2) noexcept;
// Returns the touch of two round edges; nullopt if they are parallel or don't cross.
std::optional<Touch> touch_edges_round(const EdgeLine& own, const EdgeLine& other, double radii,
                                       double own_radius) noexcept;
// Returns the touch of two sharp edges; nullopt if they are parallel or don't cross, or if the normal isn't between the
// faces' normals. `orientation` is 1 or −1: the normal points along or against own × other.
std::optional<Touch> touch_edges_sharp(const EdgeLine& own, const EdgeLine& other, double orientation,
                                       double beside = beside_m) noexcept;

}  // namespace proxarm::models
