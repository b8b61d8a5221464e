// How near two features are: one of the tool, one of an object, in the object's frame.
//
// A gap is the distance along the normal by which the features are apart; for small motions it changes by
// nᵀ(displacement of the tool's material point). Each gap that is returned is one that must not become negative,
// wherever the tool comes from outside.
//
//   point, face     where the foot lies on the face
//   edge, edge      where the nearest points lie inside of both. Of sharp edges (no radius) they hold only in the
//                   directions that lie between the normals of the faces beside them, for both solids
//   rounded ones    points and edges in any combination: the distance less both radii
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "models/rigid_shapes/circle.hpp"
#include "models/rigid_shapes/solid.hpp"

namespace proxarm::models {

// How far beside a face or beyond an edge's end, in metres, a foot may lie and still count: what rounding moves a point
// of a metre by is 1e-16 m; this is far above it, and far below what a gap at a neighbouring feature would show.
inline constexpr double beside_m = 1e-10;

struct Touch {
  Vec3 point = Vec3::Zero();    // of the tool
  Vec3 normal = Vec3::UnitZ();  // unit, towards the tool
  double gap = 0.0;
};

// Behind these lies an object, and the tool is on their free side. Each is convex from inside, so only the tool's
// points and rims can touch it.
struct FlatSide {
  Vec3 normal = Vec3::UnitZ();
  double offset = 0.0;
};
struct HollowSphere {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;
};
struct HollowTube {  // around a segment, or around a whole line
  Vec3 from = Vec3::Zero(), to = Vec3::UnitZ();
  double radius = 0.0;
  bool endless = false;
};

// Of a point with a radius.
Touch touch(const FlatSide& side, const Vec3& p, double radius) noexcept;
Touch touch(const HollowSphere& hollow, const Vec3& p, double radius) noexcept;
Touch touch(const HollowTube& hollow, const Vec3& p, double radius) noexcept;

// The points of a rim that come nearest, the nearest first. Returns their number: one; two where a rim lies askew in a
// tube; four where it is nearly level, because all of it comes near then. `level` is the first one's place in u and v,
// unit, where the rim is level to within rounding and has no lowest point. A tube counts as endless here.
int nearest_of_rim(const FlatSide& side, const Solid::Rim& rim, const Vec2& level, std::array<Vec3, 4>& out) noexcept;
int nearest_of_rim(const HollowSphere& hollow, const Solid::Rim& rim, const Vec2& level,
                   std::array<Vec3, 4>& out) noexcept;
int nearest_of_rim(const HollowTube& hollow, const Solid::Rim& rim, const Vec2& level,
                   std::array<Vec3, 4>& out) noexcept;
// Where the rim's lowest point over a side lies, in u and v, unit; zero where it is level to within rounding.
Vec2 lowest_of_rim(const FlatSide& side, const Solid::Rim& rim) noexcept;

// A segment, with the faces beside it if it is sharp.
struct EdgeLine {
  Vec3 from = Vec3::Zero(), to = Vec3::UnitX();
  Vec3 left = Vec3::Zero(), right = Vec3::Zero();
  bool open = false;  // the border of a sheet: it has a face on one side only, and any direction may hold
};

// Whether a unit direction across a sharp edge lies between the normals of its faces.
bool between(const Vec3& n, const Vec3& left, const Vec3& right) noexcept;

// A point p with a radius over a face; none if its foot isn't on the face. `side` is 1 or −1, the side of the face that
// the point is on.
std::optional<Touch> touch_face(const Vec3& p, double radius, const Vec3& normal, double offset,
                                std::span<const Vec3> points, std::span<const std::uint32_t> ring, double side,
                                double beside = beside_m) noexcept;
// Both with radii: the nearest points.
std::optional<Touch> touch_point(const Vec3& own, const Vec3& other, double radii) noexcept;
// None if the nearest point of the edge is one of its ends. `own_is_edge`: the tool's feature is the edge.
std::optional<Touch> touch_round(const Vec3& p, const EdgeLine& edge, double radii, double own_radius,
                                 bool own_is_edge) noexcept;
// Round bodies that nearly lie along each other come nearer where they cross than at the ends of where both are, by a
// sag of sine² both²/8r. None where that is next to nothing: the place is anywhere then, and the ends hold. Near that,
// what is added to the gap at the crossing, so that it gives way to the ends by degrees.
std::optional<double> gives_way_to_ends_m(const EdgeLine& one, const EdgeLine& other, double radii,
                                          double sine2) noexcept;
// Two edges, of the tool and of the object. None if they are parallel or don't cross.
std::optional<Touch> touch_edges_round(const EdgeLine& own, const EdgeLine& other, double radii,
                                       double own_radius) noexcept;
// Sharp ones; `orientation` is 1 or −1: the normal along or against own × other.
std::optional<Touch> touch_edges_sharp(const EdgeLine& own, const EdgeLine& other, double orientation,
                                       double beside = beside_m) noexcept;

}  // namespace proxarm::models
