#include "models/rigid_features/near.hpp"

#include <cmath>
#include <limits>
#include <span>

namespace proxarm::models {
namespace {

// Whether a unit direction misses the cone between the normals beside a sharp edge by more than `slack` (rad).
bool misses(const Vec3& n, const Vec3& left, const Vec3& right, double slack) noexcept {
  const Vec3 w = left.cross(right);
  const double size = w.norm();
  // The faces lie in one plane or back to back: the cone isn't known, so nothing misses it
  if (size < 1e-6) return false;
  return left.cross(n).dot(w) < -slack * size || n.cross(right).dot(w) < -slack * size || n.dot(left + right) < -slack;
}

// Returns the square of a lower bound of the distance between p and a polygon; infinity if the bound exceeds `near`.
// `height` is p's height over the polygon's plane. The corners are counter-clockwise, seen from where the normal
// points.
double distance2_to_polygon(const Vec3& normal, double height, std::span<const Vec3> points,
                            std::span<const std::uint32_t> corners, const Vec3& p, double near) noexcept {
  constexpr double too_far = std::numeric_limits<double>::infinity();
  if (!(std::abs(height) <= near)) return too_far;
  double beyond2 = 0.0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3& corner = points[corners[k]];
    const Vec3 outwards = (points[corners[k + 1 < corners.size() ? k + 1 : 0]] - corner).cross(normal);
    const double beyond = outwards.dot(p - corner);
    if (!(beyond > 0.0)) continue;
    const double size2 = outwards.squaredNorm();
    if (beyond * beyond > (near * near - height * height) * size2) return too_far;
    if (beyond * beyond > beyond2 * size2) beyond2 = beyond * beyond / size2;
  }
  return height * height + beyond2;
}

}  // namespace

double distance2_of_segments(const EdgeLine& a, const EdgeLine& b) noexcept {
  const Vec3 d1 = a.to - a.from, d2 = b.to - b.from, r = a.from - b.from;
  const double A = d1.squaredNorm(), E = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r), B = d1.dot(d2);
  const double denominator = A * E - B * B;
  double s = denominator > 1e-14 * A * E ? std::clamp((B * f - c * E) / denominator, 0.0, 1.0) : 0.0;
  double t = (B * s + f) / E;
  if (t < 0.0) {
    t = 0.0;
    s = std::clamp(-c / A, 0.0, 1.0);
  } else if (t > 1.0) {
    t = 1.0;
    s = std::clamp((B - c) / A, 0.0, 1.0);
  }
  return (r + s * d1 - t * d2).squaredNorm();
}

// 1. Two edges can hold each other only if their common normal n lies between the normals of the faces beside each edge
//    (touch_edges_sharp() requires this).
// 2. If an edge turns by `turn`, n turns by at most turn/sine, with the sine of the angle between the edges.
// 3. The normals of the faces turn by at most `turn`.
// 4. Two edges never hold each other if n misses by more than askew_rad plus twice the sum of both turns.
bool never_hold(const EdgeLine& own, const EdgeLine& other, double turn) noexcept {
  Vec3 n = (own.to - own.from).normalized().cross((other.to - other.from).normalized());
  const double sine = n.norm();
  const double slack = askew_rad + 2.0 * turn * (1.0 + 1.0 / sine);
  if (!(slack < 0.3)) return false;
  n /= sine;
  const auto held = [&](const Vec3& normal) {
    return !(!other.open && misses(normal, other.left, other.right, slack)) &&
           !(!own.open && misses(-normal, own.left, own.right, slack));
  };
  return !held(n) && !held(-n);
}

double distance2_within(const TriangleMesh& mesh, std::uint32_t index, const Vec3& p, double near) noexcept {
  const TriangleMesh::Face& face = mesh.face(index);
  return distance2_to_polygon(face.normal, TriangleMesh::height(face, p), mesh.structure().vertices,
                              mesh.triangle(index), p, near);
}

double distance2_within(const Solid& solid, const Solid::Face& face, const Vec3& p, double near) noexcept {
  return distance2_to_polygon(face.normal, face.normal.dot(p) - face.offset, solid.points, solid.corners(face), p,
                              near);
}

}  // namespace proxarm::models
