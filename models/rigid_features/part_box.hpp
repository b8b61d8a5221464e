// Finds the triangles of a mesh that come near a solid. T is the solid's frame.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "models/rigid_features/near.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

// A box around the solid's points along the axes of T and a ball around these points, both enlarged by `near`. `at`
// transforms from T into the mesh's frame.
class PartBox {
 public:
  PartBox(const Solid& solid, const Bounds& box, const View& at, double near) noexcept
      : solid_(&solid), at_(at), near_(near), middle_T_(0.5 * (box.low + box.high)) {
    middle_ = at * middle_T_;
    half_T_ = 0.5 * (box.high - box.low) + Vec3::Constant(near);
    double ball = 0.0;
    for (const Vec3& p : solid.points) ball = std::max(ball, (p - middle_T_).squaredNorm());
    for (const Solid::Rim& rim : solid.rims) {  // the middle of the box lies on the axis of both rims
      ball = std::max(ball, (rim.centre - middle_T_).squaredNorm() + rim.radius * rim.radius);
    }
    ball2_ = (std::sqrt(ball) + near) * (std::sqrt(ball) + near);
    spread_ = at.R.cwiseAbs();
    half_ = spread_ * half_T_;
  }

  [[nodiscard]] Vec3 low_T() const noexcept { return middle_T_ - half_T_; }
  [[nodiscard]] Vec3 high_T() const noexcept { return middle_T_ + half_T_; }

  // Calls visit(face, box of the face in T) for all faces within `near` of the solid, and for a few others, until visit
  // returns false.
  template <typename Visit>
  void each_face(const TriangleMesh& mesh, Visit visit) const noexcept {
    constexpr std::size_t depth = 64;  // each level of the tree halves the number of faces
    const std::vector<TriangleMesh::NodePair>& nodes = mesh.structure().nodes;
    std::array<std::uint32_t, depth> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const TriangleMesh::NodePair& pair = nodes[stack[--top]];
      for (std::size_t k = 0; k < 2; ++k) {
        const Vec3 low(pair.low(k, 0), pair.low(k, 1), pair.low(k, 2));
        const Vec3 high(pair.high(k, 0), pair.high(k, 1), pair.high(k, 2));
        if (!reaches(low, high)) continue;
        if (pair.count[k] == 0) stack[top++] = pair.first[k];
        for (std::uint32_t f = pair.first[k]; f < pair.first[k] + pair.count[k]; ++f) {
          if (!look_at(mesh, f, visit)) return;
        }
      }
    }
  }

  // Does the same for one face. Returns false if visit did.
  template <typename Visit>
  bool look_at(const TriangleMesh& mesh, std::uint32_t face, Visit& visit) const noexcept {
    Bounds box;
    box.low = box.high = at_.to_T(mesh.corner(face, 0));
    for (const std::size_t k : {1U, 2U}) {
      const Vec3 corner = at_.to_T(mesh.corner(face, k));
      box.low = box.low.cwiseMin(corner);
      box.high = box.high.cwiseMax(corner);
    }
    if ((box.low.array() > high_T().array()).any() || (box.high.array() < low_T().array()).any()) return true;
    if (solid_->radius > 0.0 && !near_round(0.5 * (box.low + box.high), 0.5 * (box.high - box.low).norm())) return true;
    if (distance2_to_box(middle_T_, box) > ball2_) return true;
    return visit(face, box);
  }

 private:
  // Whether the enlarged box meets a box along the axes of the mesh's frame: compares them along the three axes of each
  // box.
  [[nodiscard]] bool reaches(const Vec3& low, const Vec3& high) const noexcept {
    const Vec3 way = 0.5 * (low + high) - middle_, half = 0.5 * (high - low);
    if ((way.cwiseAbs() - half - half_).maxCoeff() > 0.0) return false;
    if (distance2_to_box(middle_, {low, high}) > ball2_) return false;
    return ((at_.R.transpose() * way).cwiseAbs() - spread_.transpose() * half - half_T_).maxCoeff() <= 0.0;
  }

  // Whether a ball in T comes within `near` of the points of the solid. Precondition: the solid is a sphere or a
  // capsule.
  [[nodiscard]] bool near_round(const Vec3& centre, double radius) const noexcept {
    const double most = near_ + radius;
    if (solid_->edges.empty()) return (centre - solid_->points.front()).squaredNorm() <= most * most;
    return distance2_to_segment(centre, edge_of(*solid_, 0)) <= most * most;
  }

  const Solid* solid_;
  View at_;
  double near_, ball2_ = 0.0;
  Vec3 middle_T_, half_T_;  // middle and half size of the enlarged box, in T
  // middle in the mesh's frame, and half size of the box along this frame's axes around the enlarged box
  Vec3 middle_, half_;
  Mat3 spread_;
};

}  // namespace proxarm::models
