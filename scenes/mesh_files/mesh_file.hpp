// Reads meshes: STL (text or binary), OBJ, PLY.
//
// Coordinates are as exact as the file has them (binary STL: single precision, a metre is rounded to 0.06 µm). Vertices
// that are the same in the file are still the same; load_mesh() also welds those that differ by rounding.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "models/mesh/mesh.hpp"
#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// All triangles of a file, in the file's own unit, and what became of each face. Polygons are split into triangles.
// Throws description::SetupError: no such file, not a mesh, damaged, cut off, no triangles.
ParsedMesh parse_mesh_file(const std::filesystem::path& file);
models::TriangleSoup read_mesh_file(const std::filesystem::path& file);

// Where a file's mesh is in the scene.
struct MeshPlacement {
  double scale = 1.0;  // metres per unit of the file
  models::Pose pose_W = models::Pose::Identity();
  // What lies at the pose's translation: the file's origin, the middle of the mesh's box, or the middle of its bottom
  // face. The box is along the axes of W, around all corners that faces use, after scale and rotation.
  enum class Anchor : std::uint8_t { origin, centre, low };
  Anchor anchor = Anchor::origin;
  // Corners on borders that lie within this of each other become one (models/mesh/mesh_repair.hpp); 0: none. Absent:
  // what the file's own rounding explains, default_weld().
  std::optional<double> weld_m{};
  double close_holes_m = 0.0;  // holes up to this size are closed (models/mesh/mesh_topology.hpp); 0: none
};

struct LoadedMesh {
  std::shared_ptr<const models::TriangleMesh> mesh;
  FaceAccount account;
};

// The same as a TriangleMesh, in which faces that are there more than once are there once. A large mesh leaves a cache
// beside the file (scenes/mesh_files/mesh_cache.hpp). Throws description::SetupError for what TriangleMesh refuses,
// too.
LoadedMesh load_mesh(const std::filesystem::path& file, const MeshPlacement& placement);

}  // namespace proxarm::scenes
