// Finds faces of a mesh that cross each other or lie on one another. Such faces don't matter to a point, because each
// face by itself holds a point. But a rigid tool needs a body with an inside. Where faces cross or fold back, the
// inside ends, and nothing holds the tool.
//
// Two faces that share more than corners and an edge
//   cross                if the surface of one face continues on both sides of the other face. An example is an edge
//                        in a face or on another edge, if the two faces beside the first edge are on both sides;
//   lie on one another   if one face is in the plane of the other and the faces overlap: a fold of 0°, a sheet of no
//                        thickness, a repeated face, a cube that stands on another cube in the same file.
// Faces that touch only from one side, at a point or along an edge, neither cross nor lie on one another.
//
// Whether two faces meet is decided exactly (mesh_predicates.hpp). The depth of a crossing is computed with rounding,
// and a depth within rounding doesn't count. Such depths occur because turning a mesh rounds its corners by some 1e-16
// of their size: then a needle in a flat side crosses its neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

// Lengths in metres.
//
// kCrossing_m: a rigid tool's gap may be this far below 0 (kGap_m of models/rigid_features).
//
// kSheet_m: within this distance of a face, a feature of a tool keeps the side that it had in the last step (kFront_m
// of models/rigid_features). So a sheet thinner than this has no two sides. Of 24,000 steps that press a box through a
// sheet, 10 are unresolved if the sheet is 2 nm thick, and 895 if it is 0.1 nm thick; a sheet of no thickness let the
// box in by 0.3 mm. Typical sheets are a thousand times as thick as kSheet_m.
inline constexpr double kCrossing_m = 1e-12, kSheet_m = 1e-9;

// Returns the place where the faces f and g cross or lie on one another, or nullopt if they do neither.
std::optional<Vec3> crossing_at(const TriangleMesh& mesh, std::uint32_t f, std::uint32_t g);

// Counts the pairs of faces that cross by more than kCrossing_m, and the pairs of faces that lie within kSheet_m of one
// another's plane and overlap by more than kSheet_m. Skips needles so thin that they have no normal (Face::trust).
// Stops at `most` pairs. Takes as long as building the mesh: 0.1 s for 328,000 triangles.
MeshDefect find_crossing_faces(const TriangleMesh& mesh, std::size_t most);

// Counts as find_crossing_faces() does, up to kMostCrossings pairs. A larger count would change nothing, because a mesh
// with crossing faces is refused anyway. The result is stored with the mesh.
inline constexpr std::size_t kMostCrossings = 100;
MeshDefect crossing_faces(const TriangleMesh& mesh);

}  // namespace proxarm::models
