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

// Planes that may separate a solid from triangles. For each normal it stores how far the solid reaches along it. A
// plane that separates the solid from one triangle mostly separates it from the neighbouring triangles, too.
class Planes {
 public:
  Planes(const Solid& solid, const View& at, const Apart& apart) noexcept : solid_(&solid), at_(at) {
    if (!solid.rims.empty()) return;
    for (const Vec3& n : apart.normals.first(std::min(apart.normals.size(), kGiven))) add(n);
    given_ = added_;
    if (apart.last == nullptr) return;
    for (std::size_t i = 0; i < apart.last->count; ++i) add(apart.last->normals[i]);
  }
  // Adds a plane; if there is no room, it replaces the oldest plane.
  void add(const Vec3& normal) noexcept { planes_[added_++ % kMost] = {normal, 0.0, false, false}; }
  // Whether all corners of a triangle lie more than `gap` beyond one of the planes.
  [[nodiscard]] bool leave(double gap, const std::array<Vec3, 3>& triangle) noexcept {
    if (last_ < added_ && leaves(planes_[last_], gap, triangle)) return true;
    for (std::size_t i = 0; i < std::min(added_, kMost); ++i) {
      if (i == last_ || !leaves(planes_[i], gap, triangle)) continue;
      last_ = i;
      return true;
    }
    return false;
  }
  // Writes the normals of the planes that separated a triangle; planes that the caller gave are left out.
  void keep(PlanesBetween& out) const noexcept {
    out.count = 0;
    for (std::size_t i = given_; i < std::min(added_, kMost) && out.count < out.normals.size(); ++i) {
      if (planes_[i].of_use) out.normals[out.count++] = planes_[i].normal;
    }
  }

 private:
  static constexpr std::size_t kMost = 24, kGiven = 12;
  struct Plane {
    Vec3 normal;
    double reach = 0.0;  // how far the solid reaches along the normal, m
    bool measured = false, of_use = false;
  };
  [[nodiscard]] bool leaves(Plane& plane, double gap, const std::array<Vec3, 3>& triangle) const noexcept {
    if (!plane.measured) measure(plane);
    for (const Vec3& corner : triangle) {
      if (!(plane.normal.dot(corner) - plane.reach > gap)) return false;
    }
    return plane.of_use = true;
  }
  void measure(Plane& plane) const noexcept {
    const Vec3 n = at_.R.transpose() * plane.normal;
    double reach = -std::numeric_limits<double>::infinity();
    for (const Vec3& p : solid_->points) reach = std::max(reach, n.dot(p));
    plane.reach = reach + solid_->radius + plane.normal.dot(at_.x);
    plane.measured = true;
  }

  const Solid* solid_;
  View at_;
  std::array<Plane, kMost> planes_;
  // Number of planes that were added; number of planes that the caller gave; index in planes_ of the plane that
  // separated a triangle last.
  std::size_t added_ = 0, given_ = 0, last_ = 0;
};

}  // namespace

double overlap_with_mesh(const Solid& solid, const Bounds& box, const TriangleMesh& mesh, const View& at,
                         std::optional<bool> should_be_inside, const Apart& apart) noexcept {
  const Pose X = isometry(at);
  std::optional<Cylinder> cylinder;
  if (!solid.rims.empty()) cylinder = moved(cylinder_of(solid), at.R, at.x);
  Planes planes(solid, at, apart);
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
  const PartBox part_box(solid, box, at, solid.radius);
  const auto corners = [&](std::uint32_t face) {
    return std::array<Vec3, 3>{mesh.corner(face, 0), mesh.corner(face, 1), mesh.corner(face, 2)};
  };
  const auto judge = [&](std::uint32_t face, const Bounds& /*box*/) {
    const double gap = gap_to(corners(face));
    if (gap <= apart.enough) deepest = std::min(deepest, gap);
    return true;
  };
  if (apart.triangles) {
    for (const std::uint32_t face : *apart.triangles) {
      if (!planes.leave(apart.enough, corners(face))) part_box.look_at(mesh, face, judge);
    }
  } else {
    part_box.each_face(mesh, [&](std::uint32_t face, const Bounds& at_face) {
      return planes.leave(apart.enough, corners(face)) || judge(face, at_face);
    });
  }
  if (apart.last != nullptr) planes.keep(*apart.last);
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
