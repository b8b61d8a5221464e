// Keeps what takes long about a large mesh beside its file (`part.stl.proxarm`), so that the next load is quick.
//
// It counts only for the same bytes of the mesh file, at the same scale and place (one place per file: the last one),
// and only if this user's proxarm wrote it on this machine: it is signed with a secret that is made once and kept in
// the user's cache folder ($XDG_CACHE_HOME or ~/.cache, proxarm/mesh-key). Anything else (damaged, cut off, another's,
// another version's) is as if it weren't there. Where no secret or no file can be written, nothing is kept.
//
//   "proxarm mesh 1\n\0"   16 bytes
//   SHA-256 of what the structure is of: extension, scale, pose, bytes of the mesh file
//   numbers of vertices, triangles, pairs of nodes; dropped triangles; closed    5 × u64
//   vertices (3 × f64), triangles (3 × u32), pairs of nodes, as they are in memory
//   HMAC-SHA-256 of the SHA-256 of all before
#pragma once

#include <array>
#include <filesystem>
#include <optional>

#include "models/mesh.hpp"

namespace proxarm::scenes {

class MeshCache {
 public:
  // Reads the mesh file. Smaller ones than 1 MB are quick to load and have no cache.
  MeshCache(const std::filesystem::path& mesh_file, double scale, const models::Pose& pose_W);

  [[nodiscard]] std::optional<models::TriangleMesh::Structure> load() const;
  void store(const models::TriangleMesh::Structure& structure) const;

 private:
  using Digest = std::array<unsigned char, 32>;
  bool used_ = false;
  std::filesystem::path file_;
  Digest content_{}, secret_{};
};

}  // namespace proxarm::scenes
