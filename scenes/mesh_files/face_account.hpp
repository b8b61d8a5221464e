// Counts how each face of a mesh file was used, so that no face is lost silently.
#pragma once

#include <cstdint>
#include <string>

#include "models/mesh/mesh.hpp"

namespace proxarm::scenes {

// `faces` counts every face of the file; a strip of n corners counts as n − 2. A face of n corners becomes n − 2
// triangles. So: triangles passed on = those of faces − unfit. TriangleMesh drops those of them without an area.
struct FaceAccount {
  std::uint64_t vertices = 0;  // in the file
  std::uint64_t faces = 0;
  std::uint64_t polygons = 0;          // of them, with four or more corners: split into triangles
  std::uint64_t crossing = 0;          // of the polygons, with outlines that cross themselves: split as fans
  std::uint64_t strip_faces = 0;       // from strips and fans
  std::uint64_t unfit = 0;             // with fewer than three different corners, so without area
  std::uint64_t flat = 0;              // triangles with collinear corners, so without area
  std::uint64_t unused_vertices = 0;   // used by no face
  std::uint64_t points_and_lines = 0;  // elements without area
  std::uint64_t bytes_behind = 0;      // after the last face, ignored
  std::uint64_t welded = 0;            // corners on borders that were merged into others (models/mesh/mesh_repair.hpp)
  std::uint64_t collapsed = 0;         // triangles smaller than weld_m, dropped
  std::uint64_t repeated = 0;          // duplicate faces, dropped
  std::uint64_t double_sided = 0;      // duplicate faces with the opposite front, dropped
  std::uint64_t closing = 0;           // triangles added by close_holes_m
  double welded_within_m = 0.0;        // the tolerance
  double welded_apart_m = 0.0;         // largest distance by which a corner was moved

  // "12 faces" or "134345 vertices, 268683 faces (of 134340 strips' corners …)". One line, without a full stop.
  [[nodiscard]] std::string text() const;
};

struct ParsedMesh {
  models::TriangleSoup soup;
  FaceAccount account;
  double last_digit = 0.0;  // unit of the last digit in the text file's coordinates; 0: binary
};

}  // namespace proxarm::scenes
