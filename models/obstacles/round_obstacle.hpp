// Spheres, capsules and round bars as obstacles, solid or hollow (touched from inside). Their surface is the set of the
// points at distance R ≥ 0 from a core. The core is a point, a segment or a line.
//
// The step is derived as follows:
// 1. The surface normal at r lies along the line from the core through r. N Nᵀ projects onto the tangent plane at r.
// 2. In units where K = 1, friction is −λ N Nᵀ (r − q) with an unknown λ ≥ 0. So the tangential balance is
//      N Nᵀ [(r − p) + λ (r − q)] = (1 + λ) N Nᵀ (r − p') = 0   with p' = (p + λ q)/(1 + λ).
// 3. So r is the surface point nearest to p', whereas without friction r is the surface point nearest to p.
// 4. With s = 1/(1 + λ), p' = q + s (p − q). The friction cone gives one scalar equation for s:
//      r(s) = nearest to q + s (p − q),   ‖f_t(r(s))‖ = μ f_n(r(s)),   0 ≤ s ≤ 1.
//    At s = 1 there is no friction; at s = 0 the proxy sticks (r is nearest to q).
// On a plane this equation is linear in s and gives (4). The code solves it by the secant method, with bisections.
//
// If the path from q to p passes close to the core, at o = q + s₀ (p − q), r turns around the core within a fraction of
// about σ = ‖o − core‖/‖p − q‖ of the path, and σ may be tiny. So the code uses coordinates relative to o, the unknown
// t = s − s₀, and bisections that halve an interval of asinh(t/σ). If the path passes through the core itself, r jumps
// to the side of p and the proxy sticks there, because N(r − q) = 0.
//
// The region outside a solid isn't convex. If p is beyond the solid, the proxy sticks if it can; otherwise it goes
// around the solid.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "models/obstacles/obstacle.hpp"
#include "models/surfaces/layer.hpp"

namespace proxarm::models {

// Returns the t in 0 ≤ t ≤ 1 at which q + t d is closest to the point x.
inline double closest_to_point(const Vec3& q, const Vec3& d, const Vec3& x) noexcept {
  const double length2 = d.squaredNorm();
  return length2 > 0.0 ? std::clamp(d.dot(x - q) / length2, 0.0, 1.0) : 0.0;
}

// Returns the t in 0 ≤ t ≤ 1 at which q + t d is closest to the infinite line through a along e (unit), or 0 if d is
// parallel to this line.
inline double closest_to_line(const Vec3& q, const Vec3& d, const Vec3& a, const Vec3& e) noexcept {
  const Vec3 across = d - e * e.dot(d);
  return closest_to_point(q, across, q + (a - q) - e * e.dot(a - q));
}

struct PointCore {
  Vec3 centre = Vec3::Zero();

  [[nodiscard]] Vec3 nearest(const Vec3& /*x*/) const noexcept { return centre; }
  [[nodiscard]] double closest_on_way(const Vec3& q, const Vec3& d) const noexcept {
    return closest_to_point(q, d, centre);
  }
  [[nodiscard]] double size() const noexcept { return centre.lpNorm<1>(); }
  [[nodiscard]] Vec3 any_normal() const noexcept { return Vec3::UnitZ(); }
  [[nodiscard]] Bounds bounds() const noexcept { return {centre, centre}; }
  [[nodiscard]] PointCore seen_from(const Vec3& origin) const noexcept { return {centre - origin}; }
};

struct SegmentCore {
  SegmentCore(const Vec3& from, const Vec3& to) noexcept
      : a(from), end((to - from).norm()), e(end > 0.0 ? Vec3((to - from) / end) : Vec3(Vec3::UnitZ())) {}

  [[nodiscard]] Vec3 nearest(const Vec3& x) const noexcept { return a + std::clamp(e.dot(x - a), begin, end) * e; }
  // The distance to a segment is the distance to the segment's line or to one of its ends. Each of these three
  // distances has a single minimum along the path. The function returns the t of the least minimum.
  [[nodiscard]] double closest_on_way(const Vec3& q, const Vec3& d) const noexcept {
    double best = 0.0, least = std::numeric_limits<double>::infinity();
    for (const double t :
         {closest_to_line(q, d, a, e), closest_to_point(q, d, a + begin * e), closest_to_point(q, d, a + end * e)}) {
      const Vec3 x = q + t * d;
      const double distance = (x - nearest(x)).squaredNorm();
      if (distance < least) {
        least = distance;
        best = t;
      }
    }
    return best;
  }
  [[nodiscard]] double size() const noexcept { return a.lpNorm<1>() + end; }
  [[nodiscard]] Vec3 any_normal() const noexcept { return e.unitOrthogonal(); }
  [[nodiscard]] Bounds bounds() const noexcept {
    const Vec3 b = a + end * e;
    return {a.cwiseMin(b), a.cwiseMax(b)};
  }
  // Returns the core relative to `origin`. The reference point `a` becomes the point of the line nearest to `origin`,
  // so that a distant end adds no rounding to coordinates near `origin`.
  [[nodiscard]] SegmentCore seen_from(const Vec3& origin) const noexcept {
    SegmentCore core = *this;
    const double ahead = e.dot(origin - a);
    core.a = a - origin + ahead * e;
    core.begin -= ahead;
    core.end -= ahead;
    return core;
  }

  Vec3 a;
  double begin = 0.0, end;  // the segment's ends along e, relative to a
  Vec3 e;
};

// An infinite line along e. It is the core of a cylinder's side.
struct LineCore {
  Vec3 a = Vec3::Zero();
  Vec3 e = Vec3::UnitZ();  // unit

  [[nodiscard]] Vec3 nearest(const Vec3& x) const noexcept { return a + e.dot(x - a) * e; }
  [[nodiscard]] double closest_on_way(const Vec3& q, const Vec3& d) const noexcept {
    return closest_to_line(q, d, a, e);
  }
  [[nodiscard]] double size() const noexcept { return a.lpNorm<1>(); }
  [[nodiscard]] Vec3 any_normal() const noexcept { return e.unitOrthogonal(); }
  [[nodiscard]] Bounds bounds() const noexcept { return {}; }
  [[nodiscard]] LineCore seen_from(const Vec3& origin) const noexcept {
    return {a - origin + e.dot(origin - a) * e, e};
  }
};

template <typename Core>
class RoundObstacle final : public Obstacle {
 public:
  // `inside`: the free side is towards the core. With `inside` and R = 0, the proxy stays on the core, as on a guide.
  // Throws std::invalid_argument if the radius or the friction isn't finite or is negative.
  RoundObstacle(const Core& core, double radius_m, double friction, bool inside, const Layer& layer = {})
      : core_(core), R_(radius_m), mu_(friction), sign_(inside ? -1.0 : 1.0), layer_(layer) {
    if (!std::isfinite(radius_m) || !(radius_m >= 0.0)) {
      throw std::invalid_argument("a radius must be finite and not negative");
    }
    if (!std::isfinite(friction) || !(friction >= 0.0)) {
      throw std::invalid_argument("a friction coefficient must be finite and not negative");
    }
  }

  [[nodiscard]] Step step(double K, const Vec3& p, const Vec3& q) const noexcept override;

  [[nodiscard]] Layer layer() const noexcept override { return layer_; }
  [[nodiscard]] bool presses_at(const Vec3& r) const noexcept override {
    return layer_.soft() && at(core_, r, r).height < -4.0 * rounding(r);
  }
  [[nodiscard]] bool excludes(const Vec3& q, const Vec3& r) const noexcept override {
    const double hard = at(core_, r, q).height + (layer_.soft() ? layer_.thickness_m : 0.0);
    if (hard < -4.0 * rounding(r)) return true;
    // r is beyond a solid that would have held the proxy.
    return sign_ > 0.0 && passes(q, r) && step(1.0, r, q).touches;
  }

  [[nodiscard]] bool bars(const Vec3& x, const Vec3& y) const noexcept override {
    return sign_ > 0.0 ? passes(x, y) : at(core_, y, x).height < -4.0 * rounding(y);
  }

  [[nodiscard]] Tangent tangent(const Vec3& r, std::int32_t /*feature*/) const noexcept override {
    const At here = at(core_, r, r);
    return {FlatSurface<3>::of_unit(here.foot + sign_ * R_ * here.normal, here.normal), mu_};
  }

  [[nodiscard]] double distance(const Vec3& x) const noexcept override { return at(core_, x, x).height; }

  void set_friction(double friction) noexcept override { mu_ = friction; }
  [[nodiscard]] Bounds bounds() const noexcept override {
    if (sign_ < 0.0) return {};
    const Bounds core = core_.bounds();
    return {core.low - Vec3::Constant(R_), core.high + Vec3::Constant(R_)};
  }

  [[nodiscard]] double friction() const noexcept { return mu_; }

 private:
  // A point x relative to the core and the surface.
  struct At {
    Vec3 foot;      // the core's point nearest to x
    Vec3 normal;    // the surface's normal at the surface point nearest to x
    double height;  // height of x above the surface, positive on the free side
  };

  struct Trial {
    Vec3 r;
    Vec3 normal;
    double f_n = 0.0;     // normal force divided by K
    double excess = 0.0;  // ‖f_t‖ − μ f_n, divided by K
  };

  // Returns the data of x. If x is on the core, every direction is a normal, and the direction towards `other` is
  // taken.
  [[nodiscard]] At at(const Core& core, const Vec3& x, const Vec3& other) const noexcept {
    const Vec3 foot = core.nearest(x);
    Vec3 d = x - foot;
    double distance = d.norm();
    const double measured = distance;
    if (!(distance > 0.0)) {
      d = other - core.nearest(other);
      distance = d.norm();
      if (!(distance > 0.0)) {
        d = core.any_normal();
        distance = 1.0;
      }
    }
    return {foot, (sign_ / distance) * d, sign_ * (measured - R_)};
  }

  // Returns the rounding of a height, as FlatSurface::rounding does, with the core instead of the plane's point. The
  // reserve of FlatSurface::rounding also covers the square root here.
  [[nodiscard]] double rounding(const Vec3& x) const noexcept {
    constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
    return 16.0 * u * (x.lpNorm<1>() + core_.size() + R_);
  }

  // Returns the position of the proxy on the line through `line.foot` along `line.normal`: on the surface or, within a
  // layer, where the forces along the normal balance.
  [[nodiscard]] Trial place(double K, const Vec3& p, const At& line) const noexcept {
    const Vec3& n = line.normal;
    const double along_p = n.dot(p - line.foot);  // p's coordinate along the normal, from line.foot
    double along = sign_ * R_;
    if (layer_.soft()) {
      // The balance is K (along − along_p) = k (surface − along), and the layer yields by its thickness at most.
      const double k = layer_.stiffness_N_per_m;
      along = std::max((K * along_p + k * along) / (K + k), along - layer_.thickness_m);
    }
    return judge(p, line.foot + along * n, n);
  }

  [[nodiscard]] Trial stick(double K, const Vec3& p, const Vec3& q, const At& at_q, double q_rounding) const noexcept {
    // If q is on the surface, the proxy sticks at q itself, bit for bit.
    if (!layer_.soft() && std::abs(at_q.height) <= q_rounding) return judge(p, q, at_q.normal);
    Trial trial = place(K, p, at_q);
    if (layer_.soft() && (trial.r - q).norm() <= q_rounding) trial.r = q;
    return trial;
  }

  // Solves ‖f_t‖ = μ f_n for t = s − s₀. The root is bracketed by the excess ‖f_t‖ − μ f_n: at s = 1 it is −μ f_n,
  // because there is no tangential force, and at s = 0 it is `excess_at_q` > 0. Between them the excess is nearly
  // linear (on a plane exactly linear), so the secant method needs few steps.
  [[nodiscard]] Step slide(double K, const Vec3& p, const Vec3& q, double excess_at_q) const noexcept;

  [[nodiscard]] Trial judge(const Vec3& p, const Vec3& r, const Vec3& n) const noexcept {
    Trial trial{r, n};
    const Vec3 f = r - p;
    trial.f_n = n.dot(f);
    trial.excess = (f - trial.f_n * n).norm() - mu_ * trial.f_n;
    return trial;
  }

  // Whether the straight path from q to p passes through the inside of the surface.
  [[nodiscard]] bool passes(const Vec3& q, const Vec3& p) const noexcept {
    const Vec3 x = q + core_.closest_on_way(q, p - q) * (p - q);
    return (x - core_.nearest(x)).norm() < R_ - rounding(x);
  }

  Core core_;
  double R_;
  double mu_;
  double sign_;
  Layer layer_;
};

extern template class RoundObstacle<PointCore>;
extern template class RoundObstacle<SegmentCore>;
extern template class RoundObstacle<LineCore>;

using Sphere = RoundObstacle<PointCore>;
using Capsule = RoundObstacle<SegmentCore>;
using RoundBar = RoundObstacle<LineCore>;

}  // namespace proxarm::models
