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

// How far a solid reaches along each of some normals, and against it.
class Reach {
 public:
  Reach(const Solid& solid, const View& at, std::span<const Vec3> normals) noexcept
      : normals_(solid.rims.empty() ? normals.first(std::min(normals.size(), kMost)) : normals.first(0)) {
    for (std::size_t i = 0; i < normals_.size(); ++i) {
      const Vec3 n = at.R.transpose() * normals_[i];
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const Vec3& p : solid.points) {
        low = std::min(low, n.dot(p));
        high = std::max(high, n.dot(p));
      }
      low_[i] = low - solid.radius + normals_[i].dot(at.x);
      high_[i] = high + solid.radius + normals_[i].dot(at.x);
    }
  }
  // Whether along one of them more than `gap` is between the two.
  [[nodiscard]] bool leaves(double gap, const std::array<Vec3, 3>& triangle) const noexcept {
    for (std::size_t i = 0; i < normals_.size(); ++i) {
      const Vec3& n = normals_[i];
      const auto [low, high] = std::minmax({n.dot(triangle[0]), n.dot(triangle[1]), n.dot(triangle[2])});
      if (low - high_[i] > gap || low_[i] - high > gap) return true;
    }
    return false;
  }

 private:
  static constexpr std::size_t kMost = 8;
  std::span<const Vec3> normals_;
  std::array<double, kMost> low_{}, high_{};
};

}  // namespace

double overlap_with_mesh(const Solid& solid, const Bounds& box, const TriangleMesh& mesh, const View& at,
                         std::optional<bool> should_be_inside, const Apart& apart) noexcept {
  const Pose X = isometry(at);
  std::optional<Cylinder> cylinder;
  if (!solid.rims.empty()) cylinder = moved(cylinder_of(solid), at.R, at.x);
  const Reach reach(solid, at, apart.normals);
  double deepest = 0.0;
  PartBox(solid, box, at, solid.radius).each_face(mesh, [&](std::uint32_t face, const Bounds& /*box*/) {
    const std::array<Vec3, 3> triangle = {mesh.corner(face, 0), mesh.corner(face, 1), mesh.corner(face, 2)};
    if (reach.leaves(apart.enough, triangle)) return true;
    const double gap =
        cylinder ? separation_of_cylinder(*cylinder, triangle)
        : solid.faces.empty()
            ? distance_of_segment(at * solid.points.front(), at * solid.points.back(), triangle) - solid.radius
            : separation_from_triangle(solid, X, triangle, apart.enough);
    if (gap <= apart.enough) deepest = std::min(deepest, gap);
    return true;
  });
  return deepest < 0.0
             ? deepest
             : to_wrong_side_m(mesh, at * (cylinder ? solid.rims[0].centre : solid.points.front()), should_be_inside);
}

double overlap_of_meshes(const TriangleMesh& own, const TriangleMesh& other, const View& at,
                         std::optional<bool> should_be_inside) noexcept {
  double deepest = 0.0;
  MeshPairs(own, other, at, 0.0).each([&](std::uint32_t face, std::uint32_t other_face) {
    const std::array<Vec3, 3> a = {at * own.corner(face, 0), at * own.corner(face, 1), at * own.corner(face, 2)};
    const std::array<Vec3, 3> b = {other.corner(other_face, 0), other.corner(other_face, 1),
                                   other.corner(other_face, 2)};
    deepest = std::min(deepest, separation_of_triangles(a, b));
    return true;
  });
  if (deepest < 0.0) return deepest;
  // One may be all inside of the other.
  const double other_in_own = to_wrong_side_m(own, at.to_T(other.vertex(0)), false);
  return std::min(other_in_own, to_wrong_side_m(other, at * own.vertex(0), should_be_inside));
}

}  // namespace proxarm::models
