// Finds the triangles of a mesh that come near a solid, and the features of the solid that come near these triangles.
//
// The solid is a part of the tool and the mesh an object, or the other way round. T is the solid's frame in either
// case.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "models/rigid_features/near.hpp"
#include "models/rigid_features/part_box.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

class NearFaces {
 public:
  static constexpr std::size_t most_faces = 4096;  // triangles of a mesh near a solid
  static constexpr std::size_t most_edges = 6144;  // edges of a solid: a hull of 2000 points has at most 5994

  // If more than `room` triangles come near, all() is false and no features are found. `side`: on which side of a
  // closed mesh's faces the solid is, 1 or −1; 0 for an open mesh. `at` transforms from T into the mesh's frame.
  // `reach` in m; `turn`: by how much the solid may turn in the poses to come, rad.
  NearFaces(const Solid& solid, const Bounds& box_T, const TriangleFeatures& mesh, double side, const View& at,
            double reach, double turn, std::size_t room) noexcept
      : solid_(&solid), near_(reach + solid.radius), turn_(turn), corners_turn_(turn_of_corners(turn)) {
    const PartBox around(solid, box_T, at, near_);
    around.each_face(mesh.mesh(), [&](std::uint32_t face, const Bounds& box) {
      if (count_ == room) return all_ = false;
      faces_[count_++] = face;
      // Only the part of the triangle's box that lies within the solid's box matters.
      const Vec3 low = box.low.cwiseMax(around.low_T()), high = box.high.cwiseMin(around.high_T());
      region_.low = count_ == 1 ? low : region_.low.cwiseMin(low);
      region_.high = count_ == 1 ? high : region_.high.cwiseMax(high);
      return true;
    });
    if (count_ == 0 || !all_) return;
    if (side != 0.0 && !(solid.radius > 0.0)) normals_ = cone_around(mesh, side * at.R.transpose());
    for (std::uint32_t i = 0; i < solid_->faces.size(); ++i) {
      if (may_hold(i)) facing_[facing_count_++] = static_cast<std::uint16_t>(i);
    }
    for (std::uint32_t i = 0; i < solid_->edges.size(); ++i) {
      const Solid::Around& around_edge = solid_->around_edges[i];
      if (!meets(around_edge.low, around_edge.high) || !faces_some(solid_->cones.of_edges[i])) continue;
      crossing_[crossing_count_++] = static_cast<std::uint16_t>(i);
    }
  }

  [[nodiscard]] double near() const noexcept { return near_; }
  // How much the solid may turn in the poses to come, rad.
  [[nodiscard]] double turn() const noexcept { return turn_; }
  [[nodiscard]] const NormalCone::Angle& corners_turn() const noexcept { return corners_turn_; }
  [[nodiscard]] bool all() const noexcept { return all_; }  // false: there was no room for all triangles
  [[nodiscard]] std::span<const std::uint32_t> faces() const noexcept { return {faces_.data(), count_}; }
  // Whether a box along the axes of T comes within `near` of the region of the triangles.
  [[nodiscard]] bool meets(const Vec3& low, const Vec3& high) const noexcept {
    return (low.array() <= region_.high.array() + near_).all() && (high.array() >= region_.low.array() - near_).all();
  }
  // Whether a feature of the solid with this cone of normals may rest on any of the triangles.
  [[nodiscard]] bool faces_some(const NormalCone& cone) const noexcept {
    return normals_.holds(-cone.axis, cone.half + corners_turn_);
  }
  // Returns the faces of the solid on which a vertex of the triangles may rest.
  [[nodiscard]] std::span<const std::uint16_t> facing() const noexcept { return {facing_.data(), facing_count_}; }

  // Calls visit(edge) for each edge of the solid whose box comes within `near` of the box from `low` to `high`, in T.
  // Only edges that may touch the triangles are visited.
  template <typename Visit>
  void each_crossing(const Vec3& low, const Vec3& high, Visit visit) const noexcept {
    const Vec3 least = low - Vec3::Constant(near_), most = high + Vec3::Constant(near_);
    for (std::size_t i = 0; i < crossing_count_; ++i) {
      const Solid::Around& edge = solid_->around_edges[crossing_[i]];
      if ((edge.low.array() <= most.array()).all() && (edge.high.array() >= least.array()).all()) visit(crossing_[i]);
    }
  }

  // Whether a point of T lies more than `near` in front of one of the faces in facing(). This face is remembered and
  // tried first for the next point.
  [[nodiscard]] bool beyond(const Vec3& y) noexcept {
    if (beyond_last(y, y)) return true;
    for (std::size_t i = 0; i < facing_count_; ++i) {
      if (!(height(i, y) > near_)) continue;
      witness_ = i;
      return true;
    }
    return false;
  }
  // Whether two points, and so all points between them, lie more than `near` in front of the face that beyond() found
  // last.
  [[nodiscard]] bool beyond_last(const Vec3& y, const Vec3& z) const noexcept {
    return witness_ < facing_count_ && std::min(height(witness_, y), height(witness_, z)) > near_;
  }

 private:
  [[nodiscard]] double height(std::size_t i, const Vec3& y) const noexcept {
    const Solid::Face& face = solid_->faces[facing_[i]];
    return face.normal.dot(y) - face.offset;
  }
  // Whether a vertex of the triangles may rest on a face of the solid: tests the place and the normal of the face.
  [[nodiscard]] bool may_hold(std::uint32_t index) const noexcept {
    const Solid::Around& around = solid_->around_faces[index];
    return meets(around.low, around.high) &&
           normals_.holds(-solid_->faces[index].normal, solid_->cones.around_faces[index] + corners_turn_);
  }
  // Returns the cone around the normals of all triangles and of all triangles that share a corner with them, in T.
  [[nodiscard]] NormalCone cone_around(const TriangleFeatures& mesh, const Mat3& to_T) const noexcept {
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t face : faces()) sum += face_of(mesh, face).normal;
    const double size = sum.norm();
    NormalCone cone;
    if (!(size > 0.0)) return cone;
    cone.axis = sum / size;
    NormalCone::Angle widest{1.0, 0.0};
    for (const std::uint32_t face : faces()) {
      const NormalCone::Angle half =
          mesh.around(face) + NormalCone::Angle::between(cone.axis, face_of(mesh, face).normal);
      if (half.is_any()) return {};
      if (half.cosine < widest.cosine) widest = half;
    }
    cone.half = widest.narrow();
    return cone.seen_by(to_T);
  }

  const Solid* solid_;
  double near_, turn_;
  NormalCone::Angle corners_turn_;
  Bounds region_;  // box in T around those parts of the triangles that lie within the solid's box
  std::array<std::uint32_t, most_faces> faces_;
  NormalCone normals_;  // cone around the normals of the triangles, in T
  std::array<std::uint16_t, most_edges> facing_, crossing_;
  std::size_t count_ = 0, facing_count_ = 0, crossing_count_ = 0, witness_ = 0;
  bool all_ = true;
};

}  // namespace proxarm::models
