// One step of a MeshSurface on its way from q. Internal to models.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

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
  [[nodiscard]] bool crosses(const Vec3& x) const noexcept;

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

// nᵀx − nᵀcorner is wrong by 9u of ‖x‖₁ and of ‖corner‖₁ (products and sums 4u each, the normal 2u, the offset 4u, less
// than that in the norms' sense); 16u are taken, and the lift is 64u of the largest ‖corner‖₁.
template <typename Visit>
void MeshSurface::maybe_between(const Vec3& x, const Vec3& y, double margin, Visit visit) const noexcept {
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  const double close = margin + 0.25 * lift_ + 16.0 * u * std::max(x.lpNorm<1>(), y.lpNorm<1>());
  for (std::size_t i = 0; i < near_.count; i += kTogether) {
    using Heights = Eigen::Array<double, kTogether, 1>;
    const auto of = [i](const Near::Column& column) { return column.segment<kTogether>(static_cast<Eigen::Index>(i)); };
    const Heights at_x = of(near_.x) * x.x() + of(near_.y) * x.y() + of(near_.z) * x.z() - of(near_.offset);
    const Heights at_y = of(near_.x) * y.x() + of(near_.y) * y.y() + of(near_.z) * y.z() - of(near_.offset);
    const Heights beside = at_x.min(at_y).max(-(at_x.max(at_y)));
    if ((beside > close).all()) continue;
    for (std::size_t k = 0; k < kTogether; ++k) {
      if (!(beside[static_cast<Eigen::Index>(k)] > close)) visit(near_.face[i + k]);
    }
  }
}

}  // namespace proxarm::models
