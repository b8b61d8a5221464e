// Loads meshes from STL (text or binary), OBJ and PLY files.
//
// Coordinates are as exact as in the file (binary STL: single precision, a metre is rounded to 0.06 µm). Equal vertices
// stay equal; load_mesh() also welds vertices that differ by rounding.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "models/mesh/mesh.hpp"
#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// All triangles of a file in the file's unit, with a count of how each face was used. Polygons are split into
// triangles. Throws description::SetupError: no such file, not a mesh, damaged, cut off, no triangles.
ParsedMesh parse_mesh_file(const std::filesystem::path& file);
models::TriangleSoup read_mesh_file(const std::filesystem::path& file);

// Places a file's mesh in the scene.
struct MeshPlacement {
  double scale = 1.0;  // metres per unit of the file
  models::Pose pose_W = models::Pose::Identity();
  // The point placed at the pose's translation: the file's origin, the centre of the mesh's box, or the centre of the
  // box's bottom face. The box is aligned with W and contains all corners used by faces, after scale and rotation.
  enum class Anchor : std::uint8_t { origin, centre, low };
  Anchor anchor = Anchor::origin;
  // Corners on borders within this distance of each other are merged (models/mesh/mesh_repair.hpp); 0: none. nullopt:
  // the distance that the file's rounding explains, default_weld().
  std::optional<double> weld_m{};
  double close_holes_m = 0.0;  // holes up to this size are closed (models/mesh/mesh_topology.hpp); 0: none
};

struct LoadedMesh {
  std::shared_ptr<const models::TriangleMesh> mesh;
  FaceAccount account;
};

// The file's mesh as a TriangleMesh, without duplicate faces. A large mesh leaves a cache beside its file
// (scenes/mesh_files/mesh_cache.hpp). Throws description::SetupError as parse_mesh_file() does, and for meshes that
// TriangleMesh refuses.
LoadedMesh load_mesh(const std::filesystem::path& file, const MeshPlacement& placement);

}  // namespace proxarm::scenes
