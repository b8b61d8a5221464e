#include "scenes/format/dent.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "models/rigid_shapes/solid.hpp"

namespace proxarm::scenes {
namespace {

using models::Solid;
using models::Vec3;
using Triangle = std::array<Vec3, 3>;

double below(const Solid::Face& face, const Vec3& x) { return face.offset - face.normal.dot(x); }

const Solid::Face& nearest(const Solid& hull, const Vec3& x) {
  return *std::min_element(hull.faces.begin(), hull.faces.end(),
                           [&](const Solid::Face& a, const Solid::Face& b) { return below(a, x) < below(b, x); });
}

// Bounds the depth of a triangle below the hull's surface. At a point, the depth is the minimum of linear functions of
// the position, one per face of the hull. On a triangle, this minimum is at most the largest value of any one of the
// functions at the corners. The function that is smallest at the triangle's centre is used. `there` is the depth at the
// centre, `at_most` the bound.
struct Depth {
  double there, at_most;
};
Depth depth_of(const Solid& hull, const Triangle& at) {
  const Vec3 middle = (at[0] + at[1] + at[2]) / 3.0;
  const Solid::Face& face = nearest(hull, middle);
  return {below(face, middle), std::max({below(face, at[0]), below(face, at[1]), below(face, at[2])})};
}

std::array<Triangle, 4> quarters(const Triangle& at) {
  const Vec3 a = 0.5 * (at[1] + at[2]), b = 0.5 * (at[2] + at[0]), c = 0.5 * (at[0] + at[1]);
  return {Triangle{at[0], c, b}, {at[1], a, c}, {at[2], b, a}, {a, b, c}};
}

}  // namespace

double deepest_dent_m(const models::TriangleMesh& mesh, const Solid& hull) {
  constexpr double precision = 1.01;
  const double rounding_m = 1e-9 * hull.reach;  // includes the rounding of faces that lie nearly in one plane
  double deepest_m = 0.0;
  std::vector<Triangle> left;
  for (std::uint32_t face = 0; face < mesh.size(); ++face) {
    const auto& corners = mesh.triangle(face);
    left.push_back({mesh.vertex(corners[0]), mesh.vertex(corners[1]), mesh.vertex(corners[2])});
    for (const Vec3& corner : left.back()) deepest_m = std::max(deepest_m, below(nearest(hull, corner), corner));
  }
  while (!left.empty()) {
    const Triangle at = left.back();
    left.pop_back();
    const Depth depth = depth_of(hull, at);
    deepest_m = std::max(deepest_m, depth.there);
    if (depth.at_most <= precision * deepest_m + rounding_m) continue;
    for (const Triangle& quarter : quarters(at)) left.push_back(quarter);
  }
  return deepest_m;
}

}  // namespace proxarm::scenes
