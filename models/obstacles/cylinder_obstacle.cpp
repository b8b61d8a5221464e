#include "models/obstacles/cylinder_obstacle.hpp"

#include <algorithm>
#include <cmath>

#include "models/obstacles/edge_contact.hpp"

namespace proxarm::models {

CylinderObstacle::CylinderObstacle(const Vec3& from_m, const Vec3& to_m, double radius_m, double friction,
                                   const Layer& layer)
    : middle_(0.5 * (from_m + to_m)),
      e_(unit<3>(to_m - from_m)),
      half_(0.5 * (to_m - from_m).norm()),
      R_(radius_m),
      depth_(layer.thickness_m),
      side_({middle_, e_}, radius_m, friction, false, layer),
      end_{{to_m, e_, friction, layer}, {from_m, -e_, friction, layer}} {}

double CylinderObstacle::rounding(const Vec3& x) const noexcept {
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  return 16.0 * u * (x.lpNorm<1>() + middle_.lpNorm<1>() + half_ + R_);
}

// The part of the path from q to p that is inside the cylinder: from `enter` (through `feature`) to `leave`. Both are
// fractions of the path.
struct CylinderObstacle::Crossing {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  std::int32_t feature = -1;  // the feature through which the path enters; -1: q is inside
  // For each feature, the fraction of the path at which the path reaches the feature; negative unless q is on the
  // feature or outside it.
  double enters[3] = {-1.0, -1.0, -1.0};

  [[nodiscard]] bool any() const noexcept { return enter < leave && enter < 1.0 && leave > 0.0; }
  void enter_at(double t, std::int32_t by) noexcept {
    enters[by] = t;
    if (t > enter) {
      enter = t;
      feature = by;
    }
  }
};

CylinderObstacle::Crossing CylinderObstacle::cross(const Vec3& q, const Vec3& p) const noexcept {
  Crossing c;
  const double tolerance = rounding(q), infinity = std::numeric_limits<double>::infinity();
  const double z_q = along(q), z_p = along(p);
  for (const std::int32_t end : {far_end, near_end}) {
    const double sign = end == far_end ? 1.0 : -1.0, from = sign * z_q - half_, to = sign * z_p - half_;
    if (from >= -tolerance) {
      if (!(to < 0.0)) {
        c.enter = infinity;
        return c;
      }
      c.enter_at(from > tolerance ? from / (from - to) : 0.0, end);
    } else if (to > 0.0) {
      c.leave = std::min(c.leave, from / (from - to));
    }
  }
  // The path crosses the side where ‖u + t d‖ = R, with u and d across the axis.
  const Vec3 u = radial(q), d = radial(p) - u;
  const double a = d.squaredNorm(), b = u.dot(d), from = u.norm() - R_;
  const double discriminant = b * b - a * (u.norm() + R_) * from;
  if (from >= -tolerance) {
    if (!(b < 0.0) || !(discriminant > 0.0)) {
      c.enter = infinity;
      return c;
    }
    const double root = std::sqrt(discriminant);
    c.enter_at(from > tolerance ? (u.norm() + R_) * from / (root - b) : 0.0, side);
    c.leave = std::min(c.leave, (root - b) / a);
  } else if (a > 0.0) {
    c.leave = std::min(c.leave, (std::sqrt(std::max(0.0, discriminant)) - b) / a);
  }
  return c;
}

Obstacle::Step CylinderObstacle::step(double K, const Vec3& p, const Vec3& q) const noexcept {
  Crossing c = cross(q, p);
  if (!c.any()) return {p, e_, 0, false, false};
  if (c.feature < 0) {
    const double to_end = half_ - std::abs(along(q)), to_side = R_ - radial(q).norm();
    c.feature = to_side < to_end ? side : along(q) > 0.0 ? far_end : near_end;
    c.enters[c.feature] = 0.0;
  }
  const double tolerance = rounding(q);
  const auto alone = [&](std::int32_t feature) {
    Step s = feature == side ? side_.step(K, p, q) : end_[feature - 1].step(K, p, q);
    s.feature = feature;
    return s;
  };
  Step best;
  double best_t = -1.0, best_distance = 0.0;
  for (const std::int32_t feature : {side, far_end, near_end}) {
    const double t = c.enters[feature];
    if (t < 0.0) continue;
    const Step s = alone(feature);
    if (!s.touches) continue;
    const bool on = feature == side ? std::abs(along(s.r)) <= half_ + tolerance : radial(s.r).norm() <= R_ + tolerance;
    const double distance = s.slips ? (s.r - p).norm() : 0.0;  // 0: sticking is preferred to slipping
    if (on && (t > best_t || (t == best_t && distance < best_distance))) {
      best = s;
      best_t = t;
      best_distance = distance;
    }
  }
  if (best.touches) return best;

  return beside_face(c.feature, alone(c.feature), K, p, q);
}

// Finishes the step `s` on the entered feature, which ends beyond the rim. If p is beyond the same rim, the proxy is
// free. Otherwise the rim holds it: each point of the rim is an edge between the end and the side's tangent plane at
// this point.
Obstacle::Step CylinderObstacle::beside_face(std::int32_t feature, const Step& s, double K, const Vec3& p,
                                             const Vec3& q) const noexcept {
  const Step free{p, s.normal, 0, false, false};
  if (!s.touches) return free;
  const double z = along(s.r), z_p = along(p);
  const Vec3 u = radial(s.r);
  if (feature == side ? std::abs(z_p) > half_ && (z_p > 0.0) == (z > 0.0)
                      : radial(p).norm() > R_ && radial(p).dot(u) > 0.0) {
    return free;
  }
  // Finds the contact point on the rim, as an angle from the direction of q towards the direction of p. At angle 0 the
  // step along the rim's tangent leads towards p, and at the last angle it leads back towards q.
  const Vec3 end = std::copysign(1.0, z) * e_, u_q = radial(q), first = (u_q.norm() > 0.0 ? u_q : u).normalized();
  // The sign of the tangent is chosen by p. The tangent isn't computed from p, because the part of p's direction across
  // `first` may be almost zero.
  const Vec3 u_p = radial(p), tangent = e_.cross(first);
  const Vec3 onward = tangent.dot(u_p) < 0.0 ? Vec3(-tangent) : tangent;
  const StepOnPlanes step{side_.friction(), K, end_[0].layer(), p, q};
  EdgeContact held{};
  Vec3 out;
  const auto drawn_on = [&](double angle) {
    out = std::cos(angle) * first + std::sin(angle) * onward;
    const Vec3 rim = middle_ + half_ * end + R_ * out;
    held = feature == side ? hold_at_edge(rim, out, end, step) : hold_at_edge(rim, end, out, step);
    return (std::cos(angle) * onward - std::sin(angle) * first).dot(held.r - rim);
  };
  const double last = std::atan2(onward.dot(u_p), first.dot(u_p)), nothing = 0.25 * rounding(p);
  const bool found = false_position(drawn_on, 0.0, last, nothing, 64.0 * nothing) && held.found;
  // A step along the tangent leaves the rim slightly; this moves the point back to the rim.
  held.r += (R_ - std::max(R_, radial(held.r).norm())) * out;
  return {held.r, held.normal, feature, true, held.slips, found};
}

bool CylinderObstacle::excludes(const Vec3& q, const Vec3& r) const noexcept {
  if (std::min(half_ - std::abs(along(r)), R_ - radial(r).norm()) > 2.0 * rounding(r) + depth_) return true;
  const Crossing c = cross(q, r);
  return c.any() && c.leave < 1.0 && step(1.0, r, q).touches;
}

// Depth in a convex solid is a concave function. So at the middle of a chord, the depth is at least half of the
// greatest depth on the chord.
bool CylinderObstacle::bars(const Vec3& x, const Vec3& y) const noexcept {
  const Crossing c = cross(x, y);
  if (!c.any()) return false;
  const Vec3 middle = x + 0.5 * (std::max(c.enter, 0.0) + std::min(c.leave, 1.0)) * (y - x);
  return distance(middle) < -2.0 * rounding(middle);
}

// The proxy slides along the entered side or end, from the point of entry to the rim.
Vec3 CylinderObstacle::detour(const Vec3& p, const Vec3& q) const noexcept {
  const Crossing c = cross(q, p);
  if (!c.any() || c.feature < 0 || step(1.0, p, q).touches) return q;
  const Vec3 from = q + std::max(c.enter, 0.0) * (p - q);
  const Vec3 d = (c.feature == side ? side_.step(1.0, p, q) : end_[c.feature - 1].step(1.0, p, q)).r - from;
  if (c.feature == side) {
    const double z = along(from), rise = e_.dot(d), share = (std::copysign(half_, rise) - z) / rise;
    const Vec3 on_rim = from + (rise != 0.0 ? std::clamp(share, 0.0, 1.0) : 0.0) * d, u = radial(on_rim);
    return on_rim + (R_ / u.norm() - 1.0) * u;
  }
  // The path reaches the rim of the end where ‖u + t v‖ = R.
  const Vec3 u = radial(from), v = radial(d);
  const double a = v.squaredNorm(), b = u.dot(v), inside = std::max(0.0, R_ * R_ - u.squaredNorm());
  return a > 0.0 ? Vec3(from + std::min(1.0, (std::sqrt(b * b + a * inside) - b) / a) * d) : from;
}

Obstacle::Tangent CylinderObstacle::tangent(const Vec3& r, std::int32_t feature) const noexcept {
  return feature == side ? side_.tangent(r, 0) : end_[feature - 1].tangent(r, 0);
}

double CylinderObstacle::distance(const Vec3& x) const noexcept {
  const double z = std::abs(along(x)) - half_, across = radial(x).norm() - R_;
  return std::hypot(std::max(z, 0.0), std::max(across, 0.0)) + std::min(0.0, std::max(z, across));
}

Bounds CylinderObstacle::bounds() const noexcept {
  const Vec3 reach = half_ * e_.cwiseAbs() + R_ * (Vec3::Ones() - e_.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  return {middle_ - reach, middle_ + reach};
}

}  // namespace proxarm::models
