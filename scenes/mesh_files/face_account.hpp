// Counts how each face of a mesh file was used, so that no face is lost silently.
#pragma once

#include <cstdint>
#include <string>

#include "models/mesh/mesh.hpp"

namespace proxarm::scenes {

// `faces` counts every face of the file; a strip of n corners counts as n − 2 faces. A face of n corners becomes n − 2
// triangles. Therefore the number of triangles passed on is the number of triangles of all faces, minus `unfit`.
// TriangleMesh later drops triangles without an area.
struct FaceAccount {
  std::uint64_t vertices = 0;  // vertices in the file
  std::uint64_t faces = 0;
  std::uint64_t polygons = 0;          // faces with four or more corners, which are split into triangles
  std::uint64_t crossing = 0;          // polygons whose outline crosses itself, which are split as fans
  std::uint64_t strip_faces = 0;       // faces from strips and fans
  std::uint64_t unfit = 0;             // faces with fewer than three different corners, which have no area
  std::uint64_t flat = 0;              // triangles with collinear corners, which have no area
  std::uint64_t unused_vertices = 0;   // vertices that no face uses
  std::uint64_t points_and_lines = 0;  // points and lines in the file, which have no area
  std::uint64_t bytes_behind = 0;      // bytes after the last face, which are ignored
  // Corners on borders that were merged into other corners (models/mesh/mesh_repair.hpp).
  std::uint64_t welded = 0;
  std::uint64_t collapsed = 0;     // triangles smaller than weld_m, which were dropped
  std::uint64_t repeated = 0;      // duplicate faces, which were dropped
  std::uint64_t double_sided = 0;  // duplicate faces with the opposite front side, which were dropped
  std::uint64_t closing = 0;       // triangles that close_holes_m added
  double welded_within_m = 0.0;    // tolerance of welding, in metres
  double welded_apart_m = 0.0;     // largest distance by which welding moved a corner, in metres

  // Returns for example "12 faces" or "134345 vertices, 268683 faces (of 134340 strips' corners …)": one line without a
  // full stop.
  [[nodiscard]] std::string text() const;
};

struct ParsedMesh {
  models::TriangleSoup soup;
  FaceAccount account;
  // Unit of the last digit of the coordinates in a text file; 0 for a binary file.
  double last_digit = 0.0;
};

}  // namespace proxarm::scenes
