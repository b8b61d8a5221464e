// How the faces of a mesh hang together: where it is open, and what is wrong with it.
//
// A proxy needs none of this: nothing passes a face, however faces are connected. But it falls through a hole that
// nobody knew of. Vertices with the same coordinates are one (TriangleMesh), so what is found are gaps in space, not
// in a file's numbering.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "models/mesh/mesh.hpp"
#include "models/mesh/mesh_crossings.hpp"

namespace proxarm::models {

// A closed outline of the mesh: a loop of edges that have a face on one side only.
struct MeshHole {
  std::vector<std::uint32_t> loop;  // vertices, in turn
  Vec3 centre = Vec3::Zero();       // the mean of them, in W
  // Four times the area that closes it over its length: the diameter of a round hole, the side of a square one, twice
  // the width of a crack.
  double size_m = 0.0;
};

// Edges with a face on one side only that don't come back to where they begin: they end at an edge of three and more
// faces, or where fronts change.
struct MeshBorder {
  std::size_t edges = 0;
  double length_m = 0.0;
  Vec3 centre = Vec3::Zero();  // the mean of its vertices, in W
};

struct MeshTopology {
  std::size_t parts = 0;            // faces that share an edge are of one part
  std::vector<MeshHole> holes;      // the smallest first
  std::vector<MeshBorder> borders;  // the shortest first
  MeshDefect non_manifold;          // edges of three and more faces
  MeshDefect flipped;               // faces seen from behind where most of their part is seen from the front
  std::size_t one_sided = 0;        // parts of which nobody can say which side is the front, such as a Möbius strip
  std::size_t inside_out = 0;       // closed parts whose fronts are inside
};
MeshTopology topology_of(const TriangleMesh& mesh);

// What keeps a mesh from being a body, with an inside: "is open, with a hole of 12 mm at …" and the like; and what may
// be done about it. Empty for one that is. `closing`: how many of its triangles close_holes_m has added, which may be
// those that lie on others.
struct NoInside {
  std::string what, advice;
};
NoInside why_no_inside(const TriangleMesh& mesh, std::uint64_t closing = 0);

// The mesh with all holes up to that size closed by triangles between their vertices. Where nothing is to be closed the
// soup is that of the mesh.
TriangleSoup with_holes_closed(const TriangleMesh& mesh, double up_to_m);

// "12 mm at x 0.1, y 0.2, z 0.3 m" and the like, for people.
std::string place_text(const Vec3& at_W);
std::string size_text(double size_m);

}  // namespace proxarm::models
