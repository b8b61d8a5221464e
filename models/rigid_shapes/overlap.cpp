#include "models/rigid_shapes/overlap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace proxarm::models {
namespace {

std::array<Vec3, 3> sides_of(const std::array<Vec3, 3>& triangle) noexcept {
  return {(triangle[1] - triangle[0]).normalized(), (triangle[2] - triangle[1]).normalized(),
          (triangle[0] - triangle[2]).normalized()};
}

// Returns how far the points of `a` reach along n.
double furthest(const Vec3& n, std::span<const Vec3> a) noexcept {
  double out = -std::numeric_limits<double>::infinity();
  for (const Vec3& p : a) out = std::max(out, n.dot(p));
  return out;
}

const Vec3& furthest_of(const Vec3& n, std::span<const Vec3> a) noexcept {
  return *std::max_element(a.begin(), a.end(), [&n](const Vec3& p, const Vec3& q) { return n.dot(p) < n.dot(q); });
}

// Looks for a plane that leaves a gap between a and b, beginning with the normal n of a plane that leaves none. Each
// turn takes the furthest point of a along n and the furthest point of b against n. If these points lie past each
// other, n is reflected like in a mirror between the points, so that they no longer do (Chung and Wang, 1996). If the
// bodies are clearly apart, a few turns are enough. `try_along` gets each normal and how far a reaches along it; if it
// returns true, the search ends.
template <typename Try>
bool seek_plane(Vec3 n, std::span<const Vec3> a, std::span<const Vec3> b, Try try_along) noexcept {
  constexpr int most_turns = 32;
  for (int k = 0; k < most_turns; ++k) {
    const Vec3& own = furthest_of(n, a);
    if (try_along(n, n.dot(own))) return true;
    const Vec3 way = furthest_of(-n, b) - own;
    const double past = n.dot(way), size2 = way.squaredNorm();
    if (!(past < 0.0) || !(size2 > 0.0)) return false;
    n = (n - 2.0 * past / size2 * way).normalized();
  }
  return false;
}

// Returns the gap between a body and the points b, along n. Precondition: `own` is the largest nᵀp of the body's points
// p.
double gap_beyond(double own, const Vec3& n, std::span<const Vec3> b) noexcept { return -furthest(-n, b) - own; }

// True if a plane with the normal n may lie on a convex body along one of its edges, that is, if n lies between the
// normals of the faces beside the edge. For other n the edge isn't furthest along n, and another plane leaves the gap
// that counts. An edge without faces allows any n.
bool holds_along(const Solid::Edge& edge, const Vec3& along, const Vec3& n) noexcept {
  if (edge.left.isZero(0.0)) return true;
  const double turn = edge.left.cross(edge.right).dot(along);
  return turn * edge.left.cross(n).dot(along) >= 0.0 && turn * n.cross(edge.right).dot(along) >= 0.0;
}

// Tries the two normals that are perpendicular to two unit directions. Parallel directions define no such normal. Below
// an angle of a millionth of a radian, the planes of the faces beside the edges are accurate enough: the gap along a
// direction changes by at most the solids' size times the angle.
template <typename Try>
void across(const Vec3& own, const Vec3& other, Try try_along) noexcept {
  const Vec3 n = own.cross(other);
  if (n.norm() < 1e-6) return;
  try_along(n.normalized());
  try_along(-n.normalized());
}

double to_segment(const Vec3& p, const Vec3& from, const Vec3& to) noexcept {
  const Vec3 along = to - from;
  const double length2 = along.squaredNorm();
  const double s = length2 > 0.0 ? std::clamp(along.dot(p - from) / length2, 0.0, 1.0) : 0.0;
  return (p - from - s * along).norm();
}

// Returns the distance of two segments. If the nearest points of the two lines lie inside both segments, these points
// are nearest; otherwise an end of a segment is.
double between_segments(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) noexcept {
  double least = std::min({to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b)});
  const Vec3 u = b - a, v = d - c, n = u.cross(v), w = c - a;
  const double nn = n.squaredNorm();
  if (nn > 0.0) {
    const double s = w.cross(v).dot(n) / nn, t = w.cross(u).dot(n) / nn;
    if (s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) least = std::min(least, std::abs(w.dot(n)) / std::sqrt(nn));
  }
  return least;
}

}  // namespace

double separation_of_hulls(const Solid& a, const Pose& X, const Solid& b, double enough) noexcept {
  double largest = -std::numeric_limits<double>::infinity();
  const Pose to_a = X.inverse();
  for (const Solid::Face& face : a.faces) {
    const Vec3 n = X.linear() * face.normal;
    largest = std::max(largest, gap_beyond(face.offset + n.dot(X.translation()), n, b.points));
    if (largest > enough) return largest;
  }
  for (const Solid::Face& face : b.faces) {
    const Vec3 n = to_a.linear() * face.normal;
    largest = std::max(largest, gap_beyond(face.offset + n.dot(to_a.translation()), n, a.points));
    if (largest > enough) return largest;
  }
  for (const Solid::Edge& own : a.edges) {
    const Vec3 along_a = (a.points[own.to] - a.points[own.from]).normalized(), along = X.linear() * along_a;
    for (const Solid::Edge& other : b.edges) {
      const Vec3 along_b = (b.points[other.to] - b.points[other.from]).normalized();
      across(along, along_b, [&](const Vec3& n) {
        const Vec3 n_a = to_a.linear() * n;
        if (!holds_along(own, along_a, n_a) || !holds_along(other, along_b, -n)) return;
        largest = std::max(largest, gap_beyond(furthest(n_a, a.points) + n.dot(X.translation()), n, b.points));
      });
    }
  }
  return largest;
}

Separation separation_from_triangle(const Solid& a, const Pose& X, const std::array<Vec3, 3>& triangle,
                                    double enough) noexcept {
  const Pose to_a = X.inverse();
  const std::array<Vec3, 3> b = {to_a * triangle[0], to_a * triangle[1], to_a * triangle[2]};
  const std::array<Vec3, 3> sides = sides_of(b);
  const Vec3 normal = sides[0].cross(sides[1]).normalized();
  // (the normal is in the frame of a until the end)
  Separation largest{-std::numeric_limits<double>::infinity(), normal};
  const auto is_enough = [&](const Vec3& n, double own) {
    if (!(n.squaredNorm() > 1.0 - 1e-6)) return false;  // a needle-shaped triangle, for which rounding leaves no plane
    const double gap = gap_beyond(own, n, b);
    if (gap > largest.gap) largest = {gap, n};
    return gap > enough;
  };
  const auto told = [&]() -> Separation { return {largest.gap, X.linear() * largest.normal}; };
  // Most pairs that are apart are separated by one of the following planes. The planes are tried in the order of their
  // cost, the cheapest first.
  for (const Vec3& n : {normal, Vec3(-normal)}) {
    if (is_enough(n, furthest(n, a.points))) return told();
  }
  for (const Solid::Face& face : a.faces) {
    if (is_enough(face.normal, face.offset)) return told();
  }
  for (const Vec3& side : sides) {
    const Vec3 n = side.cross(normal);
    if (is_enough(n, furthest(n, a.points))) return told();
  }
  if (seek_plane(largest.normal, a.points, b, is_enough)) return told();
  for (const Solid::Edge& own : a.edges) {
    const Vec3 along = (a.points[own.to] - a.points[own.from]).normalized();
    for (const Vec3& side : sides) {
      across(along, side, [&](const Vec3& n) {
        if (holds_along(own, along, n)) is_enough(n, n.dot(a.points[own.from]));
      });
      if (largest.gap > enough) return told();
    }
  }
  return told();
}

double separation_of_triangles(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b) noexcept {
  double largest = -std::numeric_limits<double>::infinity();
  const auto try_along = [&](const Vec3& n) {
    const Vec3 on_a(n.dot(a[0]), n.dot(a[1]), n.dot(a[2])), on_b(n.dot(b[0]), n.dot(b[1]), n.dot(b[2]));
    largest = std::max({largest, on_b.minCoeff() - on_a.maxCoeff(), on_a.minCoeff() - on_b.maxCoeff()});
  };
  for (const auto* triangle : {&a, &b}) {
    const std::array<Vec3, 3> sides = sides_of(*triangle);
    const Vec3 normal = sides[0].cross(sides[1]).normalized();
    try_along(normal);
    for (const Vec3& side : sides) try_along(side.cross(normal));
  }
  for (const Vec3& own : sides_of(a)) {
    for (const Vec3& other : sides_of(b)) across(own, other, try_along);
  }
  return largest;
}

double distance_of_segment(const Vec3& from, const Vec3& to, const std::array<Vec3, 3>& triangle) noexcept {
  const Vec3 normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
  const auto over = [&](const Vec3& p) {
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
      inside = inside && normal.cross(triangle[(k + 1) % 3] - triangle[k]).dot(p - triangle[k]) >= 0.0;
    }
    return inside;
  };
  double least = std::numeric_limits<double>::infinity();
  const double h_from = normal.dot(from - triangle[0]), h_to = normal.dot(to - triangle[0]);
  if (over(from)) least = std::min(least, std::abs(h_from));
  if (over(to)) least = std::min(least, std::abs(h_to));
  if (h_from * h_to < 0.0 && over(from + h_from / (h_from - h_to) * (to - from))) return 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    least = std::min(least, between_segments(from, to, triangle[k], triangle[(k + 1) % 3]));
  }
  return least;
}

}  // namespace proxarm::models
