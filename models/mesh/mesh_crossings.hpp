// Whether the faces of a mesh cross each other or lie on one another. That doesn't matter to a point, which each face
// holds by itself. But a rigid tool needs a body with an inside, and where faces cross or fold back, the inside ends
// and nothing holds the tool.
//
// A pair of faces with more in common than corners and an edge
//   crosses  if the surface continues there on both sides of the other face. This includes an edge that lies in a
//            face or on an edge, if the two faces beside it are on both sides;
//   lies on one another  if one of them is in the plane of the other and they overlap: a fold of 0°, a sheet of no
//            thickness, a repeated face, a cube that stands on another one in the same file.
// Faces that only touch from one side, at a point or along an edge, do neither.
//
// Whether two faces meet is decided exactly (mesh_predicates.hpp). The depth of a crossing is computed, and depths
// within rounding don't count: turning a mesh rounds its corners by some 1e-16 of their size, and a needle in a flat
// side crosses its neighbours by that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

// Metres. kCrossing_m: a rigid tool's gap may be this far below 0 (kGap_m of models/rigid_features). kSheet_m: this
// near to a face, a feature keeps its side of the last step (kFront_m there), so a thinner sheet has no two sides. (Of
// 24,000 steps that press a box through a sheet of 2 nm, 10 are unresolved; of 0.1 nm, 895; a sheet of no thickness let
// it in by 0.3 mm.) Typical sheets are a thousand times as thick.
inline constexpr double kCrossing_m = 1e-12, kSheet_m = 1e-9;

// The place where two faces cross or lie on one another; nullopt if they do neither.
std::optional<Vec3> crossing_at(const TriangleMesh& mesh, std::uint32_t f, std::uint32_t g);

// Counts pairs of faces that cross by more than kCrossing_m, or that lie within kSheet_m of one another's plane and
// overlap there by more than that. Skips needles so thin that they have no normal (Face::trust). Stops at `most` pairs.
// Takes as long as building the mesh: 0.1 s for 328,000 triangles.
MeshDefect find_crossing_faces(const TriangleMesh& mesh, std::size_t most);

// The same up to kMostCrossings pairs; more change nothing, because such a mesh is refused anyway. The result is kept
// with the mesh.
inline constexpr std::size_t kMostCrossings = 100;
MeshDefect crossing_faces(const TriangleMesh& mesh);

}  // namespace proxarm::models
