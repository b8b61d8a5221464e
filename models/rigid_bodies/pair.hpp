// Defines a pair of features that may touch: a feature of the tool and a feature of an object.
#pragma once

#include <array>
#include <cstdint>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// In the names up to edge_point the tool's feature comes first. A field is a flat or hollow object; the distance from
// it is defined at every point.
enum class PairKind : std::uint8_t {
  point_field,
  rim_field,
  point_face,
  face_point,
  edges,        // both edges are sharp
  round_edges,  // at least one of the edges has a radius
  point_point,
  point_edge,
  edge_point,
  // A feature of a cylinder and a feature of another body. The cylinder is a part of the tool or the object.
  side_point,
  end_point,
  rim_point,
  side_edge,
  rim_edge,
  rim_face,
  // Features of two cylinders, first of the tool's cylinder, then of the object's.
  sides,
  rim_side,
  side_rim,
  rim_end,
  end_rim,
  rims
};

// True if the object is flat or hollow.
constexpr bool is_in_field(PairKind kind) noexcept {
  return kind == PairKind::point_field || kind == PairKind::rim_field;
}
constexpr bool is_point_and_face(PairKind kind) noexcept {
  return kind == PairKind::point_face || kind == PairKind::face_point;
}
// True if the pair has a feature of a cylinder, and the other body is a solid, a mesh or another cylinder. This relies
// on the order of the enumerators.
constexpr bool is_of_cylinder(PairKind kind) noexcept { return kind >= PairKind::side_point; }
constexpr bool is_of_two_cylinders(PairKind kind) noexcept { return kind >= PairKind::sides; }
// The features may touch at several places; features of other pairs touch at one at most.
constexpr bool has_several_places(PairKind kind) noexcept {
  return kind == PairKind::rim_field || is_of_cylinder(kind);
}
// True for a rim over a flat surface.
constexpr bool is_flat_rim(PairKind kind) noexcept {
  return kind == PairKind::rim_field || kind == PairKind::rim_face || kind == PairKind::rim_end ||
         kind == PairKind::end_rim;
}
// True if both features are straight and at least one is round. A small turn then may move the place of contact far
// along the features.
constexpr bool is_along_side(PairKind kind) noexcept {
  return kind == PairKind::sides || kind == PairKind::side_edge || kind == PairKind::round_edges;
}

struct Pair {
  PairKind kind = PairKind::point_field;
  std::uint16_t part = 0, entry = 0;  // indices in RigidSetup
  std::uint32_t own = 0, other = 0;   // index of the part's feature; index of the entry's feature
  // The side on which the pair's face or edge holds the tool, 1 or −1; 0 if the pair isn't judged in this part of the
  // step.
  float side = 0.0F;
  bool pressed = false;  // the pair had a force in the last local problem
  bool barred = false;   // the pair's normal proved unlawful in this part of the step, so the pair isn't judged
  float apart_m = 0.0F;  // lower bound of the distance when the pair was gathered; 0 for pairs with a cylinder
  // Force on the tool at the pair's first place in the last solution, N. Unlike PressedPlaces, this force is kept when
  // pairs are gathered anew.
  Vec3 force_W = Vec3::Zero();
  // Direction of a rim's lowest point, in the rim's u and v, before the rim lay flat
  std::array<double, 2> level{1.0, 0.0};
};

}  // namespace proxarm::models
