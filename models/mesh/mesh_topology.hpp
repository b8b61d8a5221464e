// Describes how the faces of a mesh are connected: where the mesh is open, and which defects it has.
//
// A proxy needs no connections between faces, because nothing passes a face. But it falls through a hole that was
// overlooked. Vertices with the same coordinates are one vertex (TriangleMesh), so the gaps found here are gaps in
// space, not gaps in a file's numbering.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "models/mesh/mesh.hpp"
#include "models/mesh/mesh_crossings.hpp"

namespace proxarm::models {

// A hole of the mesh: a closed loop of edges that have a face on one side only.
struct MeshHole {
  std::vector<std::uint32_t> loop;  // vertices, in order
  Vec3 centre = Vec3::Zero();       // mean of the vertices, in W
  // Four times the area that closes the hole, over the loop's length: the diameter of a round hole, the side of a
  // square hole, twice the width of a crack.
  double size_m = 0.0;
};

// An open chain of edges that have a face on one side only. The chain ends at an edge of three or more faces, or where
// neighbouring faces have opposite fronts.
struct MeshBorder {
  std::size_t edges = 0;
  double length_m = 0.0;
  Vec3 centre = Vec3::Zero();  // mean of the vertices, in W
};

struct MeshTopology {
  std::size_t parts = 0;            // connected parts; faces that share an edge are in one part
  std::vector<MeshHole> holes;      // smallest first
  std::vector<MeshBorder> borders;  // shortest first
  MeshDefect non_manifold;          // edges of three or more faces
  MeshDefect flipped;               // faces whose front is opposite to most faces of their part
  std::size_t one_sided = 0;        // parts in which no choice of fronts agrees everywhere, such as a Möbius strip
  std::size_t inside_out = 0;       // closed parts whose fronts are inside
};
MeshTopology topology_of(const TriangleMesh& mesh);

// Returns why a mesh isn't a body with an inside ("is open, with a hole of 12 mm at …"), and what the user can do about
// it. Both texts are empty for a body. `closing`: the number of triangles that close_holes_m has added to the mesh;
// these triangles may be what lies on other faces.
struct NoInside {
  std::string what, advice;
};
NoInside why_no_inside(const TriangleMesh& mesh, std::uint64_t closing = 0);

// Returns the mesh with all holes up to the size up_to_m closed by triangles between the holes' vertices. If the mesh
// has no such hole, returns the mesh's own triangles.
TriangleSoup with_holes_closed(const TriangleMesh& mesh, double up_to_m);

// Returns a place or a length as text for users: "x 0.1, y 0.2, z 0.3 m" and "12 mm".
std::string place_text(const Vec3& at_W);
std::string size_text(double size_m);

}  // namespace proxarm::models
