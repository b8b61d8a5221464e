// The features of what is beside a cylinder, in its own frame: a convex solid, or a mesh of which one side is touched.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "models/rigid_features/rigid_features.hpp"
#include "models/rigid_features/rigid_object.hpp"

namespace proxarm::models {

class BesideCylinder {
 public:
  struct Face {
    Vec3 normal = Vec3::UnitZ();
    double offset = 0.0;
    std::span<const Vec3> points;
    std::span<const std::uint32_t> ring;
    double side = 1.0;  // −1: the ring runs clockwise, seen from where the normal points

    // Whether the point's foot lies on it.
    [[nodiscard]] bool over(const Vec3& p, double beside = beside_m) const noexcept {
      return touch_face(p, 0.0, side * normal, 0.0, points, ring, 1.0, beside).has_value();
    }
  };

  explicit BesideCylinder(const Solid& solid) noexcept : solid_(&solid), radius_(solid.radius) {}
  // `held` is 1 or −1, the side of its faces that is touched.
  BesideCylinder(const TriangleFeatures& mesh, double held) noexcept : mesh_(&mesh), held_(held) {}

  [[nodiscard]] const Solid* solid() const noexcept { return solid_; }
  [[nodiscard]] const TriangleFeatures* mesh() const noexcept { return mesh_; }
  [[nodiscard]] double radius() const noexcept { return radius_; }
  [[nodiscard]] const Vec3& point(std::uint32_t i) const noexcept {
    return mesh_ != nullptr ? mesh_->vertex(i) : solid_->points[i];
  }
  [[nodiscard]] EdgeLine edge(std::uint32_t i) const noexcept {
    if (mesh_ == nullptr) return edge_of(*solid_, i);
    EdgeLine line = mesh_->edge(i).line;
    line.left *= held_;
    line.right *= held_;
    return line;
  }
  [[nodiscard]] Face face(std::uint32_t i) const noexcept {
    if (mesh_ == nullptr) {
      const Solid::Face& face = solid_->faces[i];
      return {face.normal, face.offset, solid_->points, solid_->corners(face)};
    }
    const Vec3 normal = held_ * face_of(*mesh_, i).normal;
    return {normal, normal.dot(face_of(*mesh_, i).corner), mesh_->mesh().structure().vertices,
            mesh_->mesh().triangle(i), held_};
  }
  // A mesh's valley is touched by nothing sharp.
  [[nodiscard]] bool sticks_out(std::uint32_t edge) const noexcept {
    return mesh_ == nullptr || mesh_->edge(edge).ridge == (held_ > 0.0);
  }
  // Of a solid: how high the lowest place of a rim is over its faces but one, at most.
  [[nodiscard]] double highest_over_others(const Solid::Rim& rim, std::uint32_t face) const noexcept {
    double most = -std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < solid_->faces.size(); ++i) {
      if (i != face) most = std::max(most, height_of_lowest(rim, solid_->faces[i].normal, solid_->faces[i].offset));
    }
    return most;
  }
  static double height_of_lowest(const Solid::Rim& rim, const Vec3& normal, double offset) noexcept {
    return normal.dot(rim.centre) - rim.radius * std::hypot(normal.dot(rim.u), normal.dot(rim.v)) - offset;
  }

 private:
  const Solid* solid_ = nullptr;
  const TriangleFeatures* mesh_ = nullptr;
  double held_ = 1.0, radius_ = 0.0;
};

}  // namespace proxarm::models
