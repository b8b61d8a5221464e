#include "models/obstacles/box_obstacle.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "models/obstacles/edge_contact.hpp"

namespace proxarm::models {

std::array<FlatSurface<3>, 6> BoxObstacle::faces(const Pose& X, const Vec3& size_m) {
  const auto face = [&](int k, double sign) {
    const Vec3 n = sign * X.linear().col(k);
    return FlatSurface<3>(X.translation() + 0.5 * size_m[k] * n, n);
  };
  return {face(0, 1.0), face(0, -1.0), face(1, 1.0), face(1, -1.0), face(2, 1.0), face(2, -1.0)};
}

BoxObstacle::BoxObstacle(const Pose& X, const Vec3& size_m, double friction, const Layer& layer)
    : centre_(X.translation()),
      axes_(X.linear()),
      half_(0.5 * size_m),
      mu_(friction),
      layer_(layer),
      faces_(faces(X, size_m)) {
  if (!size_m.allFinite() || !(size_m.minCoeff() > 0.0))
    throw std::invalid_argument("a box needs finite, positive sizes");
  if (!std::isfinite(friction) || !(friction >= 0.0)) {
    throw std::invalid_argument("a friction coefficient must be finite and not negative");
  }
}

double BoxObstacle::rounding(const Vec3& x) const noexcept {
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  return 16.0 * u * (x.lpNorm<1>() + centre_.lpNorm<1>() + half_.sum());
}

// The part of the path from q to p that is inside all three slabs: from `enter` (through face `face`) to `leave`. Both
// are fractions of the path.
struct BoxObstacle::Crossing {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  int face = -1;  // the face through which the path enters; -1: q is inside
  // For each face, the fraction of the path at which the path reaches the face's plane; negative unless q is on this
  // plane or outside it.
  std::array<double, 6> enters{};

  [[nodiscard]] bool any() const noexcept { return enter < leave && enter < 1.0 && leave > 0.0; }
};

BoxObstacle::Crossing BoxObstacle::cross(const Vec3& q, const Vec3& p) const noexcept {
  Crossing c;
  c.enters.fill(-1.0);
  const Vec3 a = local(q), b = local(p);
  const double tolerance = rounding(q);
  for (int k = 0; k < 3; ++k) {
    for (int s = 0; s < 2; ++s) {
      const double sign = s == 0 ? 1.0 : -1.0, from = sign * a[k] - half_[k], to = sign * b[k] - half_[k];
      const int face = 2 * k + s;
      if (from >= -tolerance) {  // q is outside this face or on it
        if (!(to < 0.0)) {
          // p is outside this face, too, so the path misses the box.
          c.enter = std::numeric_limits<double>::infinity();
          continue;
        }
        const double t = from > tolerance ? from / (from - to) : 0.0;
        c.enters[static_cast<std::size_t>(face)] = t;
        if (t > c.enter) {
          c.enter = t;
          c.face = face;
        }
      } else if (to > 0.0) {
        c.leave = std::min(c.leave, from / (from - to));
      }
    }
  }
  return c;
}

Obstacle::Step BoxObstacle::step(double K, const Vec3& p, const Vec3& q) const noexcept {
  Crossing c = cross(q, p);
  if (!c.any()) return {p, Vec3::UnitZ(), 0, false, false};
  if (c.face < 0) {
    // q is inside the box: the proxy leaves through the nearest face.
    const Vec3 q_l = local(q);
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      for (int s = 0; s < 2; ++s) {
        const double depth = half_[k] - (s == 0 ? q_l[k] : -q_l[k]);
        if (depth < least) {
          least = depth;
          c.face = 2 * k + s;
        }
      }
    }
    c.enters[static_cast<std::size_t>(c.face)] = c.enter = 0.0;
  }
  const double tolerance = rounding(q);
  const auto on_face = [&](int face, const Vec3& r) {
    const Vec3 r_l = local(r);
    for (int k = 0; k < 3; ++k) {
      if (k != face / 2 && std::abs(r_l[k]) > half_[k] + tolerance) return false;
    }
    return true;
  };
  // The path enters the box through the last plane that it crosses (slab method). So among the faces that hold the
  // proxy, the face with the largest t counts. If several faces have the same t (q is on an edge), the face that holds
  // the proxy nearest to p counts.
  Step best;
  double best_t = -1.0, best_distance = 0.0;
  for (int face = 0; face < 6; ++face) {
    const double t = c.enters[static_cast<std::size_t>(face)];
    if (t < 0.0) continue;
    const FaceStep<3> s = step_on_layer(faces_[static_cast<std::size_t>(face)], mu_, layer_, K, p, q);
    if (!s.touches || !on_face(face, s.r)) continue;
    const double distance = s.slips ? (s.r - p).norm() : 0.0;  // 0: sticking is preferred to slipping
    if (t > best_t || (t == best_t && distance < best_distance)) {
      best = {s.r, faces_[static_cast<std::size_t>(face)].normal(), face, true, s.slips};
      best_t = t;
      best_distance = distance;
    }
  }
  if (best.touches) return best;

  return beside_face(c.face, K, p, q);
}

// Finishes a step that ends beside the entered face. If p is beyond the edge that the step passed, the proxy is free.
// Otherwise this edge holds the proxy, or the corner at the edge's end does.
Obstacle::Step BoxObstacle::beside_face(std::int32_t face, double K, const Vec3& p, const Vec3& q) const noexcept {
  const FlatSurface<3>& entered = faces_[static_cast<std::size_t>(face)];
  const StepOnPlanes step{mu_, K, layer_, p, q};
  const FaceStep<3> s = step.on(entered);
  const Step free{p, entered.normal(), 0, false, false};
  if (!s.touches) return free;
  const int across = face / 2;
  const Vec3 p_l = local(p), r_l = local(s.r);
  Vec3 corner = r_l;
  corner[across] = face % 2 == 0 ? half_[across] : -half_[across];
  int edge = -1, edges = 0;
  for (int k = 0; k < 3; ++k) {
    if (k == across || std::abs(r_l[k]) <= half_[k]) continue;
    if (std::abs(p_l[k]) > half_[k] && (p_l[k] > 0.0) == (r_l[k] > 0.0)) return free;
    corner[k] = std::copysign(half_[k], r_l[k]);
    edge = k;
    ++edges;
  }
  if (edges == 1) {
    const int along = 3 - across - edge;
    const EdgeContact held =
        hold_at_edge(centre_ + axes_ * corner, entered.normal(), std::copysign(1.0, r_l[edge]) * axes_.col(edge), step);
    const double at = local(held.r)[along];
    if (std::abs(at) <= half_[along]) return {held.r, held.normal, face, true, held.slips, held.found};
    corner[along] = std::copysign(half_[along], at);
  }
  const EdgeContact held = hold_at_corner(centre_ + axes_ * corner, mu_, p, q);
  return {held.r, held.normal, face, true, held.slips};
}

bool BoxObstacle::excludes(const Vec3& q, const Vec3& r) const noexcept {
  const Vec3 r_l = local(r);
  if ((half_ - r_l.cwiseAbs()).minCoeff() > 2.0 * rounding(r) + layer_.thickness_m) return true;
  const Crossing c = cross(q, r);
  // r is beyond the box, and the proxy can't go around the box.
  return c.any() && c.leave < 1.0 && step(1.0, r, q).touches;
}

// Depth in a convex solid is a concave function. So at the middle of a chord, the depth is at least half of the
// greatest depth on the chord.
bool BoxObstacle::bars(const Vec3& x, const Vec3& y) const noexcept {
  const Crossing c = cross(x, y);
  if (!c.any()) return false;
  const Vec3 middle = x + 0.5 * (std::max(c.enter, 0.0) + std::min(c.leave, 1.0)) * (y - x);
  return distance(middle) < -2.0 * rounding(middle);
}

// The proxy slides along the entered face, from the point of entry to the edge of the face.
Vec3 BoxObstacle::detour(const Vec3& p, const Vec3& q) const noexcept {
  const Crossing c = cross(q, p);
  if (!c.any() || c.face < 0 || step(1.0, p, q).touches) return q;
  const FlatSurface<3>& entered = faces_[static_cast<std::size_t>(c.face)];
  const Vec3 from = entered.projection(q + std::max(c.enter, 0.0) * (p - q));
  const Vec3 d = step_on_layer(entered, mu_, layer_, 1.0, p, q).r - from, from_l = local(from),
             d_l = axes_.transpose() * d;
  double share = 1.0;
  for (int k = 0; k < 3; ++k) {
    if (k == c.face / 2 || !(std::abs(from_l[k] + d_l[k]) > half_[k])) continue;
    const double at = (std::copysign(half_[k], d_l[k]) - from_l[k]) / d_l[k];
    share = std::clamp(at, 0.0, share);
  }
  return from + share * d;
}

Obstacle::Tangent BoxObstacle::tangent(const Vec3& /*r*/, std::int32_t feature) const noexcept {
  return {faces_[static_cast<std::size_t>(feature)], mu_};
}

double BoxObstacle::distance(const Vec3& x) const noexcept {
  const Vec3 d = local(x).cwiseAbs() - half_;
  return d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff());
}

Bounds BoxObstacle::bounds() const noexcept {
  const Vec3 reach = axes_.cwiseAbs() * half_;
  return {centre_ - reach, centre_ + reach};
}

}  // namespace proxarm::models
