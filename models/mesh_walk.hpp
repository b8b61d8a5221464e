// One step of a MeshSurface on its way from q. Internal to models.
#pragma once

#include <array>

#include "models/mesh_surface.hpp"

namespace proxarm::models {

struct MeshSurface::Walk {
  // A face that is touched, on the proxy's side.
  struct Side {
    std::uint32_t face;
    int side;            // 1: in front, −1: behind, 0: exactly in the triangle's plane (only a q from outside can be)
    Vec3 point, normal;  // of the surface that is touched, a lift away from the face
    [[nodiscard]] FlatSurface<3> surface() const noexcept { return FlatSurface<3>::of_unit(point, normal); }
  };
  static constexpr std::size_t kMost = 64;  // of more faces around one vertex, those with the least indices
  static constexpr std::size_t kAll = 8;    // up to so many, all sets are tried; else only faces that share a side

  // Where a set of faces lets the proxy go: all of the way to r, or a share of it.
  struct Target {
    Vec3 r;
    double share;
    std::array<std::size_t, 3> of;  // in touched
    std::array<bool, 3> slips;
    std::size_t count;
    std::size_t exit = 3;  // of a single face: the side that it leaves by; 3: none
  };
  enum class Went { nowhere, on, arrived };

  Walk(MeshSurface& surface, const Vec3& to, const Vec3& from) noexcept;
  Vec3 run() noexcept;

  [[nodiscard]] TriangleMesh::Hit look(const Vec3& x, const Vec3& y) noexcept;
  void touch() noexcept;
  void touch(std::uint32_t index, const TriangleMesh::Face& face) noexcept;
  void add(std::uint32_t index, const TriangleMesh::Face& face, int side) noexcept;
  [[nodiscard]] bool touches(std::uint32_t index) const noexcept;
  bool leave_planes() noexcept;

  Went run_into(const TriangleMesh::Hit& hit, const Vec3& towards) noexcept;
  Went go(const Target& target) noexcept;
  Went try_free() noexcept;
  Went try_singles() noexcept;
  Went try_pairs() noexcept;
  Went try_pair(std::size_t i, std::size_t j) noexcept;
  Went try_triples() noexcept;
  void hold() noexcept;
  [[nodiscard]] bool can_hold(std::size_t count, const std::array<std::size_t, 3>& of) const noexcept;
  void report(std::size_t count, const std::array<std::size_t, 3>& of, const std::array<bool, 3>& slips) noexcept;

  [[nodiscard]] double share_on(std::uint32_t face, const Vec3& to, std::size_t& exit) const noexcept;
  [[nodiscard]] bool goes_back(const Target& target) const noexcept;
  [[nodiscard]] bool is_around(std::uint32_t face, const Vec3& x, double lifts) const noexcept;

  MeshSurface& s;
  const TriangleMesh& mesh;
  const double lift;
  const Vec3 p, q;
  Vec3 c;                   // where it is
  Vec3 p_at;                // p, or where the way there ends for tests if it is out of all proportion
  std::uint32_t came_from;  // the face whose side was passed in the last move
  int budget;               // what the step may still cost
  std::size_t count = 0;
  std::array<Side, kMost> touched;
};

}  // namespace proxarm::models
