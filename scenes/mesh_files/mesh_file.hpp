// Loads meshes from STL (text or binary), OBJ and PLY files.
//
// Coordinates are as exact as in the file. (Binary STL has single precision, which rounds a metre to 0.06 µm.) Equal
// vertices stay equal; load_mesh() also welds vertices that differ only by rounding.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "models/mesh/mesh.hpp"
#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// Return all triangles of a file in the file's unit; parse_mesh_file() also counts how each face was used. Polygons are
// split into triangles. Throw description::SetupError if there is no such file, if it isn't a mesh, is damaged or cut
// off, or if it has no triangles.
ParsedMesh parse_mesh_file(const std::filesystem::path& file);
models::TriangleSoup read_mesh_file(const std::filesystem::path& file);

// How a file's mesh is placed in the scene.
struct MeshPlacement {
  double scale = 1.0;  // metres per unit of the file
  models::Pose pose_W = models::Pose::Identity();
  // The point of the mesh that is placed at the translation of pose_W: the file's origin, the centre of the mesh's box,
  // or the centre of the box's bottom face. The box is aligned with W and contains all corners that faces use, after
  // scaling and rotation.
  enum class Anchor : std::uint8_t { origin, centre, low };
  Anchor anchor = Anchor::origin;
  // Corners on borders that are at most this far apart are merged (models/mesh/mesh_repair.hpp); 0: no corner is
  // merged; nullopt: the distance is the one that the file's rounding explains, default_weld().
  std::optional<double> weld_m{};
  // Holes up to this size are closed (models/mesh/mesh_topology.hpp); 0: no hole is closed.
  double close_holes_m = 0.0;
};

struct LoadedMesh {
  std::shared_ptr<const models::TriangleMesh> mesh;
  FaceAccount account;
};

// Loads the file's mesh as a TriangleMesh, without duplicate faces. For a large mesh, writes a cache beside the file
// (scenes/mesh_files/mesh_cache.hpp). Throws description::SetupError as parse_mesh_file() does, and if TriangleMesh
// refuses the mesh.
LoadedMesh load_mesh(const std::filesystem::path& file, const MeshPlacement& placement);

}  // namespace proxarm::scenes
