// Gives the features of the body that a cylinder touches, in this body's frame. The body is a convex solid, or a mesh
// that is touched on one side.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "models/rigid_bodies/rigid_setup.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

class BesideCylinder {
 public:
  struct Face {
    Vec3 normal = Vec3::UnitZ();
    double offset = 0.0;
    std::span<const Vec3> points;
    std::span<const std::uint32_t> ring;
    double side = 1.0;  // −1: the ring runs clockwise, as seen from where the normal points

    // Whether the foot of p lies on the face.
    [[nodiscard]] bool over(const Vec3& p, double beside = beside_m) const noexcept {
      return touch_face(p, 0.0, side * normal, 0.0, points, ring, 1.0, beside).has_value();
    }
  };

  explicit BesideCylinder(const Solid& solid) noexcept : solid_(&solid), radius_(solid.radius) {}
  // `held`: the side of the mesh's faces that is touched, 1 or −1.
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
  // Returns false for a valley of a mesh; no sharp feature can touch a valley.
  [[nodiscard]] bool sticks_out(std::uint32_t edge) const noexcept {
    return mesh_ == nullptr || mesh_->edge(edge).ridge == (held_ > 0.0);
  }
  // Returns the largest height of a rim's lowest place over the solid's faces, with one face left out, m. Precondition:
  // the body is a solid.
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

// Returns the body beside the cylinder. Precondition: the part or the object is a cylinder.
inline BesideCylinder beside_cylinder(const RigidPart& part, const RigidEntry& entry) noexcept {
  if (!part.cylinder) return part.mesh ? BesideCylinder(*part.mesh, 1.0) : BesideCylinder(part.solid);
  const TriangleFeatures* mesh = entry.mesh();
  return mesh != nullptr ? BesideCylinder(*mesh, entry.held) : BesideCylinder(*entry.solid());
}

}  // namespace proxarm::models
