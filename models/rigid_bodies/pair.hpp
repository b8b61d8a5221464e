// A pair of features that may touch: one of the tool, one of an object.
#pragma once

#include <array>
#include <cstdint>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// The tool's feature comes first. A field is a flat or hollow object, whose distance is known everywhere.
enum class PairKind : std::uint8_t {
  point_field,
  rim_field,
  point_face,
  face_point,
  edges,        // both sharp
  round_edges,  // at least one has a radius
  point_point,
  point_edge,
  edge_point,
  // A feature of a cylinder and one of another body; the cylinder may be the tool's or the object's.
  side_point,
  end_point,
  rim_point,
  side_edge,
  rim_edge,
  rim_face,
  // Features of two cylinders, the tool's first.
  sides,
  rim_side,
  side_rim,
  rim_end,
  end_rim,
  rims
};

// A flat or hollow object takes part.
constexpr bool is_in_field(PairKind kind) noexcept {
  return kind == PairKind::point_field || kind == PairKind::rim_field;
}
constexpr bool is_point_and_face(PairKind kind) noexcept {
  return kind == PairKind::point_face || kind == PairKind::face_point;
}
// A cylinder's feature and one of a solid, a mesh or another cylinder. The order of the enumerators counts.
constexpr bool is_of_cylinder(PairKind kind) noexcept { return kind >= PairKind::side_point; }
constexpr bool is_of_two_cylinders(PairKind kind) noexcept { return kind >= PairKind::sides; }
// A rim over a flat surface.
constexpr bool is_flat_rim(PairKind kind) noexcept {
  return kind == PairKind::rim_field || kind == PairKind::rim_face || kind == PairKind::rim_end ||
         kind == PairKind::end_rim;
}
// Both features are straight and one is round: a small turn moves the place of contact far along them.
constexpr bool is_along_side(PairKind kind) noexcept {
  return kind == PairKind::sides || kind == PairKind::side_edge || kind == PairKind::round_edges;
}

struct Pair {
  PairKind kind = PairKind::point_field;
  std::uint16_t part = 0, entry = 0;  // indices in RigidSetup
  std::uint32_t own = 0, other = 0;   // features of the part and of the entry
  float side = 0.0F;     // of a two-sided surface: 1 or −1; 0 if the pair isn't judged in this part of the step
  bool pressed = false;  // it had a force in the last local problem
  bool barred = false;   // its normal proved unlawful in this part of the step: the pair isn't judged
  float apart_m = 0.0F;  // lower bound of the distance when the pair was gathered; 0 for pairs with a cylinder
  // Force at the pair's first place in the last solution, N. Unlike PressedPlaces it is kept when pairs are gathered.
  Vec3 force_W = Vec3::Zero();
  std::array<double, 2> level{1.0, 0.0};  // lowest direction of a rim, in its u and v, before it lay flat
};

}  // namespace proxarm::models
