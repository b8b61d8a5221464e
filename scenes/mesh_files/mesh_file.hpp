// Reads meshes: STL (text or binary), OBJ, PLY.
//
// Coordinates pass through single precision (binary STL has no other; the reader of the rest keeps no more): a metre is
// rounded to 0.06 µm. From there on all is double, and vertices that were the same are still the same.
#pragma once

#include <filesystem>
#include <memory>

#include "models/mesh/mesh.hpp"

namespace proxarm::scenes {

// All triangles of a file, in the file's own unit. Polygons are split into triangles; lines and points are left out.
// Throws description::SetupError: no such file, not a mesh, damaged, no triangles.
models::TriangleSoup read_mesh_file(const std::filesystem::path& file);

// The same as a TriangleMesh, scaled to metres and moved to its pose in the scene. A large mesh leaves a cache beside
// the file (scenes/mesh_files/mesh_cache.hpp). Throws description::SetupError for what TriangleMesh refuses, too.
std::shared_ptr<const models::TriangleMesh> load_mesh(const std::filesystem::path& file, double scale,
                                                      const models::Pose& pose_W);

}  // namespace proxarm::scenes
