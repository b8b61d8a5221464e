// Which triangles of two meshes come near each other.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

// Goes down both trees at once. `at` leads from the frame of the first mesh to that of the second.
class MeshPairs {
 public:
  MeshPairs(const TriangleMesh& own, const TriangleMesh& other, const View& at, double near) noexcept
      : own_(&own), other_(&other), at_(at), near_(near), spread_(at.R.cwiseAbs()) {}

  // Calls visit(own face, other face) for each two that come so near, and some that don't, until it returns false.
  template <typename Visit>
  void each(Visit visit) const noexcept {
    // Each of two trees halves its faces at each level, and a node that is divided leaves one of its halves to wait.
    std::array<NodesOfBoth, 130> stack;
    std::size_t top = 0;
    // The root is alone in its pair.
    push_near(stack, top, own_node(own_->structure().nodes.front(), 0),
              other_node(other_->structure().nodes.front(), 0));
    while (top > 0) {
      const NodesOfBoth next = stack[--top];
      if (next.own.count > 0 && next.other.count > 0) {
        if (!look_at(next.own, next.other, visit)) return;
        continue;
      }
      const bool divide_own = next.other.count > 0 || (next.own.count == 0 && next.own.size() > next.other.size());
      for (std::size_t k = 0; k < 2; ++k) {
        if (divide_own) {
          push_near(stack, top, own_node(own_->structure().nodes[next.own.first], k), next.other);
        } else {
          push_near(stack, top, next.own, other_node(other_->structure().nodes[next.other.first], k));
        }
      }
    }
  }

  // Whether two of them come so near, by their boxes and planes.
  [[nodiscard]] bool come_near(std::uint32_t own, std::uint32_t other) const noexcept {
    return come_near(own_triangle(own), other);
  }

 private:
  // A node of a tree: its box by middle and half, in its mesh's frame, and in the other one a box around that.
  struct Node {
    Vec3 middle, half, half_there;
    std::uint32_t first = 0, count = 0;  // as of TriangleMesh::NodePair
    [[nodiscard]] double size() const noexcept { return half.squaredNorm(); }
  };
  struct NodesOfBoth {
    Node own, other;  // the own one's middle is in the other frame
  };

  [[nodiscard]] Node own_node(const TriangleMesh::NodePair& pair, std::size_t k) const noexcept {
    Node node = box_of(pair, k);
    node.half_there.noalias() = spread_ * node.half;
    node.middle = at_ * node.middle;
    return node;
  }
  // With as much room around it as may lie between.
  [[nodiscard]] Node other_node(const TriangleMesh::NodePair& pair, std::size_t k) const noexcept {
    Node node = box_of(pair, k);
    node.half.array() += near_;
    node.half_there.noalias() = spread_.transpose() * node.half;
    return node;
  }
  static Node box_of(const TriangleMesh::NodePair& pair, std::size_t k) noexcept {
    const Vec3 low(pair.low(k, 0), pair.low(k, 1), pair.low(k, 2));
    const Vec3 high(pair.high(k, 0), pair.high(k, 1), pair.high(k, 2));
    return {0.5 * (low + high), 0.5 * (high - low), {}, pair.first[k], pair.count[k]};
  }

  // The boxes, by the six axes of both.
  [[nodiscard]] bool reaches(const Node& own, const Node& other) const noexcept {
    const Vec3 way = other.middle - own.middle;
    if (((way.cwiseAbs() - own.half_there - other.half).array() > 0.0).any()) return false;
    const Vec3 way_there = at_.R.transpose() * way;
    return ((way_there.cwiseAbs() - own.half - other.half_there).array() <= 0.0).all();
  }
  template <typename Stack>
  void push_near(Stack& stack, std::size_t& top, const Node& own, const Node& other) const noexcept {
    if (reaches(own, other)) stack[top++] = {own, other};
  }

  // A triangle of the own mesh, in the other frame.
  struct Triangle {
    std::array<Vec3, 3> corners;
    Vec3 low, high, normal;
  };
  [[nodiscard]] Triangle own_triangle(std::uint32_t i) const noexcept {
    Triangle out;
    for (std::size_t k = 0; k < 3; ++k) out.corners[k] = at_ * own_->corner(i, k);
    out.low = out.corners[0].cwiseMin(out.corners[1]).cwiseMin(out.corners[2]);
    out.high = out.corners[0].cwiseMax(out.corners[1]).cwiseMax(out.corners[2]);
    out.normal.noalias() = at_.R * own_->face(i).normal;
    return out;
  }
  // By their boxes and their planes.
  [[nodiscard]] bool come_near(const Triangle& own, std::uint32_t j) const noexcept {
    const std::array<Vec3, 3> b = {other_->corner(j, 0), other_->corner(j, 1), other_->corner(j, 2)};
    const Vec3 low = b[0].cwiseMin(b[1]).cwiseMin(b[2]), high = b[0].cwiseMax(b[1]).cwiseMax(b[2]);
    if (((own.low - high).array() > near_).any() || ((low - own.high).array() > near_).any()) return false;
    return !on_one_side(other_->face(j).normal, b[0], own.corners) && !on_one_side(own.normal, own.corners[0], b);
  }

  template <typename Visit>
  bool look_at(const Node& own, const Node& other, Visit& visit) const noexcept {
    for (std::uint32_t i = own.first; i < own.first + own.count; ++i) {
      const Triangle triangle = own_triangle(i);
      const Vec3 way = other.middle - 0.5 * (triangle.low + triangle.high);  // (the other box has the room around it)
      if (((way.cwiseAbs() - other.half - 0.5 * (triangle.high - triangle.low)).array() > 0.0).any()) continue;
      for (std::uint32_t j = other.first; j < other.first + other.count; ++j) {
        if (come_near(triangle, j) && !visit(i, j)) return false;
      }
    }
    return true;
  }

  // Whether a triangle is further from a plane than it may be.
  [[nodiscard]] bool on_one_side(const Vec3& normal, const Vec3& through,
                                 const std::array<Vec3, 3>& triangle) const noexcept {
    const Vec3 heights(normal.dot(triangle[0] - through), normal.dot(triangle[1] - through),
                       normal.dot(triangle[2] - through));
    return heights.minCoeff() > near_ || heights.maxCoeff() < -near_;
  }

  const TriangleMesh *own_, *other_;
  View at_;
  double near_;
  Mat3 spread_;
};

}  // namespace proxarm::models
