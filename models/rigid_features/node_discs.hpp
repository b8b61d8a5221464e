// Encloses the triangles of each node of a mesh's tree in a disc. If flat triangles lean, a box along the axes becomes
// thick; a disc along the triangles stays thin. Its thickness depends only on how much the triangles bend.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

// Bounds of the vertices of a node's triangles, in metres, rounded up. Each vertex is at most `half` away from the
// middle along the axis, at most `radius` away across the axis, and at most `ball` away in total.
struct NodeDisc {
  Vec3 middle = Vec3::Zero(), axis = Vec3::UnitZ();
  float half = 0.0F, radius = 0.0F, ball = 0.0F;
};

class NodeDiscs {
 public:
  NodeDiscs() = default;
  explicit NodeDiscs(const TriangleMesh& mesh);

  // `index` is twice the index of a pair of nodes, plus 0 or 1 for the node in the pair.
  [[nodiscard]] const NodeDisc& of(std::uint32_t index) const noexcept { return discs_[index]; }
  [[nodiscard]] bool any() const noexcept { return !discs_.empty(); }
  // Loads a disc that is needed soon into the cache.
  void prefetch(std::uint32_t index) const noexcept {
    constexpr std::size_t line = 64;
    const char* at = reinterpret_cast<const char*>(&discs_[index]);
    __builtin_prefetch(at);
    __builtin_prefetch(at + line);
  }

 private:
  std::vector<NodeDisc> discs_;
};

struct FlatMesh {
  const TriangleMesh& mesh;
  const NodeDiscs& discs;
};

// Whether the balls of two nodes are more than `near` apart, or whether their discs are, measured along one disc's
// axis.
[[nodiscard]] inline bool apart(const NodeDisc& a, const NodeDisc& b, double near) noexcept {
  constexpr double rounding = 4e-15;  // rounding of cosine², from which the sine is computed
  const Vec3 way = b.middle - a.middle;
  const double most = double{a.ball} + double{b.ball} + near;
  if (way.squaredNorm() > most * most) return true;
  const double cosine = std::abs(a.axis.dot(b.axis));
  const double sine = std::sqrt(std::max(1.0 - cosine * cosine, 0.0) + rounding);
  return std::abs(a.axis.dot(way)) > a.half + b.half * cosine + b.radius * sine + near ||
         std::abs(b.axis.dot(way)) > b.half + a.half * cosine + a.radius * sine + near;
}

}  // namespace proxarm::models
