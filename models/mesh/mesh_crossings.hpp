// Whether the faces of a mesh keep out of one another. A point is held by each face whatever the others do; a body with
// an inside, which a rigid tool needs, ends where faces cross or fold back, and what is held there is held by nothing.
//
// A pair of faces that have more in common than corners and an edge
//   crosses  if the surface goes on on both sides of the other one, there: also where an edge of it lies in a face,
//            or on an edge, and the two faces beside the edge are on both sides;
//   lies on one another  if one of them is in the plane of the other one and they overlap there: a fold of 0°, a sheet
//            of no thickness, a face that is there twice, a cube that stands on another one in the same file.
// What only touches, in a point or along an edge, from one side, is neither.
//
// That two faces meet at all is told exactly (mesh_predicates.hpp). How deep they cross is computed, and what is less
// than rounding makes doesn't count: the corners of a mesh that is turned in the scene are rounded by some 1e-16 of
// their size, and a needle in a flat side crosses its neighbours by that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

// In metres. What a rigid tool's gap may be short of (kGap_m of models/rigid_features), and the distance of a face
// within which the side that a feature is on is taken from the step before (kFront_m there): a sheet thinner than that
// has no two sides. (Of 24,000 steps that press a box through a sheet of 2 nm 10 are unresolved, of 0.1 nm 895; one of
// no thickness let it in by 0.3 mm.) Typical sheets are a thousand times as thick.
inline constexpr double kCrossing_m = 1e-12, kSheet_m = 1e-9;

// Where two faces cross or lie on one another, if they do.
std::optional<Vec3> crossing_at(const TriangleMesh& mesh, std::uint32_t f, std::uint32_t g);

// Pairs of faces that cross by more than kCrossing_m, or that lie within kSheet_m of one another's plane and overlap
// there by more than that. Needles so thin that they have no normal (Face::trust) don't count. Stops at `most` pairs.
// Takes as long as building the mesh: 0.1 s for 328,000 triangles; 1 s for 80,000 around two corners
// (mesh_near_pairs.hpp).
MeshDefect find_crossing_faces(const TriangleMesh& mesh, std::size_t most);

// The same up to kMostCrossings pairs, since a mesh that has as many is refused like one that has more. It is found
// once, and kept with the mesh.
inline constexpr std::size_t kMostCrossings = 100;
MeshDefect crossing_faces(const TriangleMesh& mesh);

}  // namespace proxarm::models
