// Reads meshes: STL (text or binary), OBJ, PLY.
//
// Coordinates are as exact as the file has them (binary STL: single precision, a metre is rounded to 0.06 µm). Vertices
// that are the same in the file are still the same.
#pragma once

#include <filesystem>
#include <memory>

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
  double close_holes_m = 0.0;  // holes up to this size are closed (models/mesh/mesh_topology.hpp); 0: none
};

struct LoadedMesh {
  std::shared_ptr<const models::TriangleMesh> mesh;
  FaceAccount account;
};

// The same as a TriangleMesh. A large mesh leaves a cache beside the file (scenes/mesh_files/mesh_cache.hpp). Throws
// description::SetupError for what TriangleMesh refuses, too.
LoadedMesh load_mesh(const std::filesystem::path& file, const MeshPlacement& placement);

}  // namespace proxarm::scenes
