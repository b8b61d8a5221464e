// How flat a mesh is, node by node of its tree: a box along the axes is as thick as its triangles lean, a disc along
// them only as thick as they bend.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

// All vertices of a node's triangles are within `half` of the disc's middle along its axis, within `radius` of it
// across, and within `ball` of it. Metres, never too small.
struct NodeDisc {
  Vec3 middle = Vec3::Zero(), axis = Vec3::UnitZ();
  float half = 0.0F, radius = 0.0F, ball = 0.0F;
};

class NodeDiscs {
 public:
  NodeDiscs() = default;
  explicit NodeDiscs(const TriangleMesh& mesh);

  // By twice the index of a pair of nodes, and which one it is.
  [[nodiscard]] const NodeDisc& of(std::uint32_t index) const noexcept { return discs_[index]; }
  [[nodiscard]] bool any() const noexcept { return !discs_.empty(); }
  // Of one that is asked for soon.
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

// Whether more than `near` is between both balls, or between both discs along one of their axes.
[[nodiscard]] inline bool apart(const NodeDisc& a, const NodeDisc& b, double near) noexcept {
  constexpr double rounding = 4e-15;  // of a cosine's square, of which a sine is made
  const Vec3 way = b.middle - a.middle;
  const double most = double{a.ball} + double{b.ball} + near;
  if (way.squaredNorm() > most * most) return true;
  const double cosine = std::abs(a.axis.dot(b.axis));
  const double sine = std::sqrt(std::max(1.0 - cosine * cosine, 0.0) + rounding);
  return std::abs(a.axis.dot(way)) > a.half + b.half * cosine + b.radius * sine + near ||
         std::abs(b.axis.dot(way)) > b.half + a.half * cosine + a.radius * sine + near;
}

}  // namespace proxarm::models
