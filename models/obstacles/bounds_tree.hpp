// A bounding-volume tree of axis-aligned boxes. It finds the objects near a point, and the distance to the nearest
// object. Queries don't allocate and may come from any thread.
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
  // Precondition: all bounds are finite, with low ≤ high. Boxes may be points, may overlap and may coincide.
  explicit BoundsTree(std::vector<Leaf> leaves);

  // Calls visit(index) once for each leaf whose box is within `radius` of x, in no particular order.
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

  // Returns the minimum of `least` and of distance(index) over all leaves. Skips leaves whose box is no nearer to x
  // than the smallest distance so far, unless x is in the box. Precondition: if x is outside a leaf's box,
  // distance(index) is at least the distance from x to this box. (If x is in the box, distance(index) may be negative.)
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
        // The nearer child is pushed last, so it is visited next.
        stack[top++] = left_first ? node.right : node.left;
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
  // Capacity of the stack. A search keeps one node of each level, and each level halves the leaves. So ten thousand
  // objects need 15 places, and 2³² leaves, which is more than an index can count, would need 33.
  static constexpr int stack_depth_ = 80;

  static double distance2(const Bounds& b, const Vec3& x) noexcept {
    return ((b.low - x).cwiseMax(x - b.high).cwiseMax(0.0)).squaredNorm();
  }
  std::uint32_t build(std::vector<Leaf>& leaves, std::size_t begin, std::size_t end);

  std::vector<Node> nodes_;
};

}  // namespace proxarm::models
