// One step of a MeshSurface, as a walk of straight pieces from q (mesh_surface.hpp). Used only in this room.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "models/mesh/mesh_surface.hpp"
#include "models/surfaces/contact_search.hpp"

namespace proxarm::models {

struct MeshSurface::Walk {
  // A touched face, with the normal on the proxy's side.
  struct Side {
    std::uint32_t face;
    // 1 if the proxy is in front of the face, −1 if it is behind, 0 if it is exactly in the triangle's plane (only
    // possible for a caller's q).
    int side;
    Vec3 point, normal;  // point and normal of the touched surface, which is one lift in front of the face
    [[nodiscard]] FlatSurface<3> surface() const noexcept { return FlatSurface<3>::of_unit(point, normal); }
  };
  // Largest number of faces that are considered together. A regular mesh has six faces around a vertex. Of more than 64
  // faces, the faces with the least indices are considered; the proxy may then stick at a vertex where it could slide.
  static constexpr std::size_t kMost = 64;
  // For up to this many touched faces, all pairs and triples are tried. For more faces, only pairs that share a side
  // are tried, because the number of triples grows with the cube of the number of faces.
  static constexpr std::size_t kAll = 8;

  // The point to which a set of faces lets the proxy go: r, or the fraction `share` of the path to r.
  struct Target {
    Vec3 r;
    double share;
    std::array<std::size_t, 3> of;  // indices in touched
    std::array<bool, 3> slips;
    std::size_t count;
    std::size_t exit = 3;  // for a single face: the side over which the proxy leaves the face; 3: no side
  };

  Walk(MeshSurface& surface, const Vec3& to, const Vec3& from) noexcept;
  Vec3 run() noexcept;

  [[nodiscard]] TriangleMesh::Hit look(const Vec3& x, const Vec3& y) noexcept;
  void touch() noexcept;
  void touch(std::uint32_t index, const TriangleMesh::Face& face) noexcept;
  void add(std::uint32_t index, const TriangleMesh::Face& face, int side) noexcept;
  [[nodiscard]] bool touches(std::uint32_t index) const noexcept;
  bool leave_planes() noexcept;
  [[nodiscard]] bool crosses(const Vec3& x) const noexcept;

  StepResult run_into(const TriangleMesh::Hit& hit, const Vec3& towards) noexcept;
  StepResult go(const Target& target) noexcept;
  StepResult try_free() noexcept;
  StepResult try_singles() noexcept;
  StepResult try_pair(std::size_t i, std::size_t j) noexcept;
  StepResult try_triple(const std::array<std::size_t, 3>& of) noexcept;
  void hold() noexcept;
  void report_holding() noexcept;
  [[nodiscard]] bool can_support(std::size_t count, const std::array<std::size_t, 3>& of) const noexcept;
  void report(std::size_t count, const std::array<std::size_t, 3>& of, const std::array<bool, 3>& slips) noexcept;

  [[nodiscard]] double share_on(std::uint32_t face, const Vec3& to, std::size_t& exit) const noexcept;
  [[nodiscard]] bool goes_back(const Target& target) const noexcept;
  [[nodiscard]] bool is_around(std::uint32_t face, const Vec3& x, double lifts) const noexcept;

  MeshSurface& s;
  const TriangleMesh& mesh;
  const double lift;
  const Vec3 p, q;
  Vec3 c;                   // the present position of the proxy in the walk
  Vec3 p_at;                // p, or a point on the path to p if p is too far for exact tests
  std::uint32_t came_from;  // the face that the last move left over one of its sides; kNone: no such face
  int budget;               // the cost that the step may still spend, see kBudget
  std::size_t count = 0;
  std::array<Side, kMost> touched;
};

// The computed nᵀx − nᵀcorner has an error of less than 9 u of ‖x‖₁ and 9 u of ‖corner‖₁: products and sums contribute
// 4 u each, the normal 2 u and the offset 4 u. The bound in the code is 16 u of each, because a quarter of the lift is
// 16 u of the largest ‖corner‖₁.
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
