// Caches the structure of a large mesh beside its file (`part.stl.proxarm`), so that the mesh loads faster.
//
// A cache is valid only for the same bytes of the mesh file and the same placement. Each mesh file has one cache, for
// the last placement. A cache must have been written by this user's proxarm on this machine: it is signed with a
// secret. The secret is created once in the user's cache folder ($XDG_CACHE_HOME or ~/.cache, proxarm/mesh-key). An
// invalid cache (damaged, cut off, or of another user or version) is ignored. If the secret or the cache can't be
// written, there is no cache.
//
//   "proxarm mesh 3\n\0"   16 bytes
//   SHA-256 of the input: extension, scale, pose, anchor, weld_m, close_holes_m, bytes of the mesh file
//   numbers of vertices, triangles, pairs of nodes; dropped triangles; closed    5 × u64
//   use of the file's faces (FaceAccount)    15 × u64, 2 × f64
//   vertices (3 × f64), triangles (3 × u32), pairs of nodes, as they are in memory
//   HMAC-SHA-256 of the SHA-256 of all bytes before
#pragma once

#include <array>
#include <filesystem>
#include <optional>

#include "models/mesh/mesh.hpp"
#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

struct MeshPlacement;

struct CachedMesh {
  models::TriangleMesh::Structure structure;
  FaceAccount account;
};

class MeshCache {
 public:
  // Reads the mesh file to identify it. A file below 1 MB gets no cache, because it loads fast without one.
  MeshCache(const std::filesystem::path& mesh_file, const MeshPlacement& placement);

  [[nodiscard]] std::optional<CachedMesh> load() const;
  void store(const CachedMesh& mesh) const;

 private:
  using Digest = std::array<unsigned char, 32>;
  bool used_ = false;
  std::filesystem::path file_;
  Digest content_{}, secret_{};
};

}  // namespace proxarm::scenes
