// A bounding-volume tree of axis-aligned boxes: which objects are near a point, and how far is the nearest? Queries
// allocate nothing and may come from any thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "models/obstacles/obstacle.hpp"

namespace proxarm::models {

class BoundsTree {
 public:
  struct Leaf {
    Bounds bounds;
    std::size_t index = 0;
  };

  BoundsTree() = default;
  // Precondition: all bounds are finite, with low ≤ high. Boxes may be points, overlap or coincide.
  explicit BoundsTree(std::vector<Leaf> leaves);

  // Calls visit(index) once for each leaf whose box comes within `radius` of x, in no particular order.
  template <typename Visit>
  void within(const Vec3& x, double radius, Visit visit) const noexcept {
    if (nodes_.empty()) return;
    std::uint32_t stack[stack_depth_];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const Node& node = nodes_[stack[--top]];
      if (!(distance2(node.bounds, x) <= radius * radius)) continue;
      if (node.leaf) {
        visit(node.index);
      } else {
        stack[top++] = node.left;
        stack[top++] = node.right;
      }
    }
  }

  // The least of `least` and distance(index) over all leaves. Skips leaves whose box is no nearer than the best so far,
  // unless x is in the box. Precondition: distance(index) is at least the distance to the leaf's box; it may be
  // negative if x is in the box.
  template <typename Distance>
  [[nodiscard]] double nearest(const Vec3& x, double least, Distance distance) const noexcept {
    if (nodes_.empty()) return least;
    std::uint32_t stack[stack_depth_];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const Node& node = nodes_[stack[--top]];
      const double bound = std::sqrt(distance2(node.bounds, x));
      if (!(bound < least || bound == 0.0)) continue;
      if (node.leaf) {
        least = std::min(least, distance(node.index));
      } else {
        const bool left_first = distance2(nodes_[node.left].bounds, x) < distance2(nodes_[node.right].bounds, x);
        stack[top++] = left_first ? node.right : node.left;  // the nearer one is visited next
        stack[top++] = left_first ? node.left : node.right;
      }
    }
    return least;
  }

 private:
  struct Node {
    Bounds bounds;
    std::uint32_t left = 0, right = 0;
    std::size_t index = 0;
    bool leaf = false;
  };
  // Each level halves the leaves, and a search keeps one node of each level. Ten thousand objects need 15 places; 2³²
  // leaves, more than indices can name, would need 33.
  static constexpr int stack_depth_ = 80;

  static double distance2(const Bounds& b, const Vec3& x) noexcept {
    return ((b.low - x).cwiseMax(x - b.high).cwiseMax(0.0)).squaredNorm();
  }
  std::uint32_t build(std::vector<Leaf>& leaves, std::size_t begin, std::size_t end);

  std::vector<Node> nodes_;
};

}  // namespace proxarm::models
