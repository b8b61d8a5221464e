#include "models/rigid_features/mesh_overlap.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "models/rigid_features/mesh_pairs.hpp"
#include "models/rigid_features/part_box.hpp"
#include "models/rigid_shapes/cylinder.hpp"
#include "models/rigid_shapes/overlap.hpp"

namespace proxarm::models {
namespace {

double to_wrong_side_m(const TriangleMesh& mesh, const Vec3& x, std::optional<bool> should_be_inside) noexcept {
  if (!should_be_inside || mesh.encloses(x) == *should_be_inside) return 0.0;
  std::uint32_t near = 0;
  return -mesh.distance(x, std::numeric_limits<double>::infinity(), near);
}

// Planes that may lie between a solid and triangles: how far the solid reaches along some normals, and against them.
// What is apart from one triangle is mostly so from those next to it by the same plane.
class Planes {
 public:
  Planes(const Solid& solid, const View& at, std::span<const Vec3> normals) noexcept : solid_(&solid), at_(at) {
    if (solid.rims.empty()) {
      for (const Vec3& n : normals.first(std::min(normals.size(), kMost))) add(n);
    }
  }
  // The oldest goes where there is no room.
  void add(const Vec3& normal) noexcept {
    Plane& plane = planes_[added_++ % kMost];
    const Vec3 n = at_.R.transpose() * normal;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vec3& p : solid_->points) {
      low = std::min(low, n.dot(p));
      high = std::max(high, n.dot(p));
    }
    const double there = normal.dot(at_.x);
    plane = {normal, low - solid_->radius + there, high + solid_->radius + there};
  }
  // Whether along one of them more than `gap` is between the two.
  [[nodiscard]] bool leave(double gap, const std::array<Vec3, 3>& triangle) const noexcept {
    for (std::size_t i = 0; i < std::min(added_, kMost); ++i) {
      const Plane& plane = planes_[i];
      const auto [low, high] =
          std::minmax({plane.normal.dot(triangle[0]), plane.normal.dot(triangle[1]), plane.normal.dot(triangle[2])});
      if (low - plane.high > gap || plane.low - high > gap) return true;
    }
    return false;
  }

 private:
  static constexpr std::size_t kMost = 16;
  struct Plane {
    Vec3 normal;
    double low = 0.0, high = 0.0;  // of the solid
  };
  const Solid* solid_;
  View at_;
  std::array<Plane, kMost> planes_;
  std::size_t added_ = 0;
};

}  // namespace

double overlap_with_mesh(const Solid& solid, const Bounds& box, const TriangleMesh& mesh, const View& at,
                         std::optional<bool> should_be_inside, const Apart& apart) noexcept {
  const Pose X = isometry(at);
  std::optional<Cylinder> cylinder;
  if (!solid.rims.empty()) cylinder = moved(cylinder_of(solid), at.R, at.x);
  Planes planes(solid, at, apart.normals);
  double deepest = 0.0;
  const auto gap_to = [&](const std::array<Vec3, 3>& triangle) {
    if (cylinder) return separation_of_cylinder(*cylinder, triangle);
    if (solid.faces.empty()) {
      return distance_of_segment(at * solid.points.front(), at * solid.points.back(), triangle) - solid.radius;
    }
    const Separation by = separation_from_triangle(solid, X, triangle, apart.enough);
    if (by.gap > apart.enough) planes.add(by.normal);
    return by.gap;
  };
  PartBox(solid, box, at, solid.radius).each_face(mesh, [&](std::uint32_t face, const Bounds& /*box*/) {
    const std::array<Vec3, 3> triangle = {mesh.corner(face, 0), mesh.corner(face, 1), mesh.corner(face, 2)};
    if (planes.leave(apart.enough, triangle)) return true;
    const double gap = gap_to(triangle);
    if (gap <= apart.enough) deepest = std::min(deepest, gap);
    return true;
  });
  return deepest < 0.0
             ? deepest
             : to_wrong_side_m(mesh, at * (cylinder ? solid.rims[0].centre : solid.points.front()), should_be_inside);
}

double overlap_of_faces(const TriangleMesh& own, std::uint32_t face, const TriangleMesh& other,
                        std::uint32_t other_face, const View& at) noexcept {
  const std::array<Vec3, 3> a = {at * own.corner(face, 0), at * own.corner(face, 1), at * own.corner(face, 2)};
  const std::array<Vec3, 3> b = {other.corner(other_face, 0), other.corner(other_face, 1), other.corner(other_face, 2)};
  return std::min(0.0, separation_of_triangles(a, b));
}

double overlap_of_all(const TriangleMesh& own, const TriangleMesh& other, const View& at,
                      std::optional<bool> should_be_inside) noexcept {
  const double other_in_own = to_wrong_side_m(own, at.to_T(other.vertex(0)), false);
  return std::min(other_in_own, to_wrong_side_m(other, at * own.vertex(0), should_be_inside));
}

double overlap_of_meshes(const FlatMesh& own, const FlatMesh& other, const View& at,
                         std::optional<bool> should_be_inside) noexcept {
  double deepest = 0.0;
  MeshPairs(own, other, at, 0.0).each([&](std::uint32_t face, std::uint32_t other_face) {
    deepest = std::min(deepest, overlap_of_faces(own.mesh, face, other.mesh, other_face, at));
    return true;
  });
  return deepest < 0.0 ? deepest : overlap_of_all(own.mesh, other.mesh, at, should_be_inside);
}

}  // namespace proxarm::models
