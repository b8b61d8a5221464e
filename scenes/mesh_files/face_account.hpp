// What became of each face of a mesh file, so that none is lost without a word.
#pragma once

#include <cstdint>
#include <string>

#include "models/mesh/mesh.hpp"

namespace proxarm::scenes {

// Each face of the file is in `faces`; a strip of n corners is n − 2 of them. A face of n corners becomes n − 2
// triangles. So: triangles handed on = those of faces − unfit, of which TriangleMesh drops those without an area.
struct FaceAccount {
  std::uint64_t vertices = 0;  // in the file
  std::uint64_t faces = 0;
  std::uint64_t polygons = 0;          // of them, with four and more corners: split into triangles
  std::uint64_t crossing = 0;          // of these, outlines that cross themselves: split as fans
  std::uint64_t strip_faces = 0;       // out of strips and fans
  std::uint64_t unfit = 0;             // with fewer than three different corners: they have no area
  std::uint64_t flat = 0;              // triangles whose corners are on a line: they have none, either
  std::uint64_t unused_vertices = 0;   // that no face names
  std::uint64_t points_and_lines = 0;  // elements that bound nothing
  std::uint64_t bytes_behind = 0;      // that follow the last face and mean nothing
  std::uint64_t welded = 0;            // corners on borders that became others (models/mesh/mesh_repair.hpp)
  std::uint64_t collapsed = 0;         // triangles smaller than weld_m, left out
  std::uint64_t repeated = 0;          // faces left out that are there already
  std::uint64_t double_sided = 0;      // faces left out that are there already, with the opposite front
  std::uint64_t closing = 0;           // triangles that close_holes_m has added
  double welded_within_m = 0.0;        // the tolerance
  double welded_apart_m = 0.0;         // farthest that a corner was moved

  // Such as "12 faces" or "134345 vertices, 268683 faces (of 134340 strips' corners …)". One line, without a stop.
  [[nodiscard]] std::string text() const;
};

struct ParsedMesh {
  models::TriangleSoup soup;
  FaceAccount account;
  double last_digit = 0.0;  // the smallest that is written in a coordinate of a text file, in its unit; 0: binary
};

}  // namespace proxarm::scenes
