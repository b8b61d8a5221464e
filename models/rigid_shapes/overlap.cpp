#include "models/rigid_shapes/overlap.hpp"

#include <algorithm>
#include <limits>

namespace proxarm::models {
namespace {

// The points of `b` beyond those of `a`, along n.
double gap_along(const Vec3& n, const Solid& a, const Pose& X, const Solid& b) noexcept {
  const Vec3 n_a = X.linear().transpose() * n;
  double furthest = -std::numeric_limits<double>::infinity(), nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& p : a.points) furthest = std::max(furthest, n_a.dot(p));
  for (const Vec3& p : b.points) nearest = std::min(nearest, n.dot(p));
  return nearest - (furthest + n.dot(X.translation()));
}

}  // namespace

double separation_of_hulls(const Solid& a, const Pose& X, const Solid& b) noexcept {
  double largest = -std::numeric_limits<double>::infinity();
  const auto try_along = [&](const Vec3& n) { largest = std::max(largest, gap_along(n, a, X, b)); };
  for (const Solid::Face& face : a.faces) try_along(X.linear() * face.normal);
  for (const Solid::Face& face : b.faces) try_along(-face.normal);
  for (const Solid::Edge& own : a.edges) {
    const Vec3 along = X.linear() * (a.points[own.to] - a.points[own.from]).normalized();
    for (const Solid::Edge& other : b.edges) {
      const Vec3 n = along.cross((b.points[other.to] - b.points[other.from]).normalized());
      // Parallel edges have no plane of their own. Below a millionth of a radian the faces beside them are as good: the
      // gap along a direction changes by the solids' sizes times the angle.
      if (n.norm() < 1e-6) continue;
      try_along(n.normalized());
      try_along(-n.normalized());
    }
  }
  return largest;
}

}  // namespace proxarm::models
