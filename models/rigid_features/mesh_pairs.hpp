// Finds the triangles of two meshes that come near each other.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "models/rigid_features/node_discs.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

// Searches the trees of both meshes together. `at` transforms from the frame of the first mesh, `own`, into the frame
// of the second mesh, `other`. `near`: the distance up to which triangles count as near, m.
class MeshPairs {
 public:
  MeshPairs(const FlatMesh& own, const FlatMesh& other, const View& at, double near) noexcept
      : own_(&own.mesh),
        other_(&other.mesh),
        own_discs_(&own.discs),
        other_discs_(&other.discs),
        at_(at),
        near_(near) {}

  // A leaf of the first tree and a leaf of the second tree.
  struct Leaves {
    std::uint32_t own = 0, other = 0;  // twice the index of a pair of nodes, plus 0 or 1 for the node in the pair
  };

  // Calls visit(own face, other face) for all pairs of faces within `near` of each other, and for some others, until
  // visit returns false.
  template <typename Visit>
  void each(Visit visit) noexcept {
    each_leaves([&](const Node& own, const Node& other) { return look_at(own, other, visit); });
  }
  // Calls visit(Leaves) for all pairs of leaves that may contain faces within `near` of each other, until visit returns
  // false.
  template <typename Visit>
  void list(Visit visit) const noexcept {
    each_leaves([&](const Node& own, const Node& other) { return visit(Leaves{own.index, other.index}); });
  }
  // Does the same as each(), but only for leaves from a list that list() made. Precondition: the list belongs to the
  // same meshes and contains all leaves that are within `near` of each other at this pose.
  template <typename List, typename Visit>
  void each_of(const List& list, Visit visit) noexcept {
    Node own;
    bool any = false;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Leaves& leaves = list[i];
      if (i + kAhead < list.size()) other_discs_->prefetch(list[i + kAhead].other);
      if (!any || own.index != leaves.own) own = own_node(leaves.own);
      any = true;
      const Node other = other_node(leaves.other);
      if (!apart(own.disc, other.disc, near_) && !look_at(own, other, visit)) return;
    }
  }

 private:
  // Prefetch distance in list items; most leaves of a large mesh aren't in a cache
  static constexpr std::size_t kAhead = 6;
  // A node of a tree, with `first` and `count` as in TriangleMesh::NodePair. The disc is in the frame of the second
  // mesh.
  struct Node {
    NodeDisc disc;
    std::uint32_t index = 0, first = 0, count = 0;
  };
  struct NodesOfBoth {
    Node own, other;
  };

  template <typename Visit>
  void each_leaves(Visit visit) const noexcept {
    // Each level of a tree halves the number of faces, so a tree has at most 64 levels. Each division of a node leaves
    // one half on the stack.
    std::array<NodesOfBoth, 130> stack;
    std::size_t top = 0;
    push_near(stack, top, own_node(0), other_node(0));  // the root is the only node in its pair
    while (top > 0) {
      const NodesOfBoth next = stack[--top];
      if (next.own.count > 0 && next.other.count > 0) {
        if (!visit(next.own, next.other)) return;
        continue;
      }
      const bool larger = next.own.disc.ball > next.other.disc.ball;
      if (next.other.count > 0 || (next.own.count == 0 && larger)) {
        for (const std::uint32_t k : {0U, 1U}) push_near(stack, top, own_node(2 * next.own.first + k), next.other);
      } else {
        for (const std::uint32_t k : {0U, 1U}) push_near(stack, top, next.own, other_node(2 * next.other.first + k));
      }
    }
  }

  [[nodiscard]] Node own_node(std::uint32_t index) const noexcept {
    const TriangleMesh::NodePair& pair = own_->structure().nodes[index / 2];
    const NodeDisc& disc = own_discs_->of(index);
    return {{at_ * disc.middle, at_.R * disc.axis, disc.half, disc.radius, disc.ball},
            index,
            pair.first[index % 2],
            pair.count[index % 2]};
  }
  [[nodiscard]] Node other_node(std::uint32_t index) const noexcept {
    const TriangleMesh::NodePair& pair = other_->structure().nodes[index / 2];
    return {other_discs_->of(index), index, pair.first[index % 2], pair.count[index % 2]};
  }
  template <typename Stack>
  void push_near(Stack& stack, std::size_t& top, const Node& own, const Node& other) const noexcept {
    if (!apart(own.disc, other.disc, near_)) stack[top++] = {own, other};
  }

  // A triangle in the frame of the second mesh, with the box around it.
  struct Triangle {
    std::array<Vec3, 3> corners;
    Vec3 low, high, normal;
  };
  // Caches triangles: each triangle is needed several times in a row, together with different triangles of the other
  // mesh.
  class Kept {
   public:
    Kept() noexcept { face_of_.fill(0xFFFFFFFF); }  // no face
    template <typename Make>
    [[nodiscard]] const Triangle& of(std::uint32_t face, Make make) noexcept {
      const std::size_t at = face % triangles_.size();
      if (face_of_[at] == face) return triangles_[at];
      Triangle& out = triangles_[at];
      make(out);
      out.low = out.corners[0].cwiseMin(out.corners[1]).cwiseMin(out.corners[2]);
      out.high = out.corners[0].cwiseMax(out.corners[1]).cwiseMax(out.corners[2]);
      face_of_[at] = face;
      return out;
    }

   private:
    std::array<Triangle, 64> triangles_;
    std::array<std::uint32_t, 64> face_of_;
  };
  [[nodiscard]] const Triangle& own_triangle(std::uint32_t i) noexcept {
    return kept_own_.of(i, [&](Triangle& out) {
      for (std::size_t k = 0; k < 3; ++k) out.corners[k] = at_ * own_->corner(i, k);
      out.normal.noalias() = at_.R * own_->face(i).normal;
    });
  }
  [[nodiscard]] const Triangle& other_triangle(std::uint32_t j) noexcept {
    return kept_other_.of(j, [&](Triangle& out) {
      for (std::size_t k = 0; k < 3; ++k) out.corners[k] = other_->corner(j, k);
      out.normal = other_->face(j).normal;
    });
  }
  [[nodiscard]] bool boxes_apart(const Triangle& own, const Vec3& low, const Vec3& high) const noexcept {
    return ((own.low - high).array() > near_).any() || ((low - own.high).array() > near_).any();
  }
  // Whether two triangles may be within `near` of each other. It tests their boxes and planes.
  [[nodiscard]] bool come_near(const Triangle& own, const Triangle& other) const noexcept {
    if (boxes_apart(own, other.low, other.high)) return false;
    return !on_one_side(other.normal, other.corners[0], own.corners) &&
           !on_one_side(own.normal, own.corners[0], other.corners);
  }

  template <typename Visit>
  bool look_at(const Node& own, const Node& other, Visit& visit) noexcept {
    const TriangleMesh::NodePair& pair = other_->structure().nodes[other.index / 2];
    const std::size_t which = other.index % 2;
    const Vec3 low(pair.low(which, 0), pair.low(which, 1), pair.low(which, 2));
    const Vec3 high(pair.high(which, 0), pair.high(which, 1), pair.high(which, 2));
    for (std::uint32_t i = own.first; i < own.first + own.count; ++i) {
      const Triangle& triangle = own_triangle(i);
      if (boxes_apart(triangle, low, high)) continue;
      for (std::uint32_t j = other.first; j < other.first + other.count; ++j) {
        if (come_near(triangle, other_triangle(j)) && !visit(i, j)) return false;
      }
    }
    return true;
  }

  // Whether a triangle lies more than `near` above a plane, or more than `near` below it.
  [[nodiscard]] bool on_one_side(const Vec3& normal, const Vec3& through,
                                 const std::array<Vec3, 3>& triangle) const noexcept {
    const Vec3 heights(normal.dot(triangle[0] - through), normal.dot(triangle[1] - through),
                       normal.dot(triangle[2] - through));
    return heights.minCoeff() > near_ || heights.maxCoeff() < -near_;
  }

  const TriangleMesh *own_, *other_;
  const NodeDiscs *own_discs_, *other_discs_;
  View at_;
  double near_;
  Kept kept_own_, kept_other_;
};

}  // namespace proxarm::models
