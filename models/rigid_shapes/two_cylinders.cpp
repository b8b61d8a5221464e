#include "models/rigid_shapes/two_cylinders.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace proxarm::models {
namespace {

// A place on a circle, and the derivative of the place by the angle.
struct OnRim {
  Vec3 arm = Vec3::Zero();  // unit vector from the centre to the place
  Vec3 x = Vec3::Zero(), along = Vec3::Zero();
};

// Samples around a rim: the cosines and sines of their angles.
constexpr std::size_t around = 32;
constexpr double step = 2.0 * std::numbers::pi / static_cast<double>(around);
const std::array<Vec2, around>& looks() noexcept {
  static const std::array<Vec2, around> all = [] {
    std::array<Vec2, around> out;
    for (std::size_t i = 0; i < around; ++i) {
      const double angle = step * static_cast<double>(i);
      out[i] = {std::cos(angle), std::sin(angle)};
    }
    return out;
  }();
  return all;
}

OnRim on_rim(const Solid::Rim& rim, double angle) noexcept {
  const double c = std::cos(angle), s = std::sin(angle);
  const Vec3 arm = c * rim.u + s * rim.v;
  return {arm, rim.centre + rim.radius * arm, rim.radius * (c * rim.v - s * rim.u)};
}

double nearest_angle(const Solid::Rim& rim, const Vec3& p) noexcept {
  return std::atan2(rim.v.dot(p - rim.centre), rim.u.dot(p - rim.centre));
}

// Returns how far a point is outside a rim, measured in the rim's plane; negative inside.
double beyond_rim(const Solid::Rim& rim, const Vec3& p) noexcept {
  const Vec3 d = p - rim.centre;
  return std::hypot(rim.u.dot(d), rim.v.dot(d)) - rim.radius;
}

// Number of times that the interval between two samples is halved. Newton's method does the rest.
constexpr int kHalvings = 12;

// Finds the pairs of places on two circles at which their distance has a local minimum. Newton's method starts from
// samples around the smaller circle: places that are far apart on the smaller circle may be close to each other on the
// larger one.
class NearRims {
 public:
  NearRims(const Solid::Rim& one, const Solid::Rim& other) noexcept
      : swapped_(one.radius < other.radius), a_(swapped_ ? &other : &one), b_(swapped_ ? &one : &other) {
    const Solid::Rim &a = *a_, &b = *b_;
    std::array<double, around> d2, beyond;
    for (std::size_t i = 0; i < around; ++i) {
      const Vec2& look = looks()[i];
      const Vec3 d = b.centre + b.radius * (look.x() * b.u + look.y() * b.v) - a.centre;
      const double x = a.u.dot(d), y = a.v.dot(d), across2 = x * x + y * y;
      beyond[i] = std::sqrt(across2) - a.radius;
      d2[i] = std::max(0.0, d.squaredNorm() - across2) + beyond[i] * beyond[i];
    }
    for (std::size_t i = 0; i < around; ++i) {
      const std::size_t last = (i + around - 1) % around, next = (i + 1) % around;
      const double angle = step * static_cast<double>(i);
      if (d2[i] <= d2[last] && d2[i] <= d2[next]) settle(angle);
      // Circles nearly in one plane come nearest where they cross. Between two crossings the distance is larger.
      if (beyond[i] * beyond[next] < 0.0) settle(crossing(angle, angle + step));
      // Circles nearly in one plane may also cross twice between two samples. Apart from the part between these
      // crossings, the smaller circle is then on one side of the larger one.
      const double side = beyond[i] > 0.0 ? 1.0 : -1.0;
      if (side * beyond[i] <= side * beyond[last] && side * beyond[i] <= side * beyond[next]) settle_dip(angle, side);
    }
  }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] OnRim on_one(std::size_t k) const noexcept { return swapped_ ? on_b(k) : on_a(k); }
  [[nodiscard]] OnRim on_other(std::size_t k) const noexcept { return swapped_ ? on_a(k) : on_b(k); }

 private:
  [[nodiscard]] OnRim on_a(std::size_t k) const noexcept { return on_rim(*a_, angles_[k][0]); }
  [[nodiscard]] OnRim on_b(std::size_t k) const noexcept { return on_rim(*b_, angles_[k][1]); }

  void settle_dip(double angle, double side) noexcept {
    double low = angle - step, high = angle + step;
    const auto beyond = [&](double at) { return side * beyond_rim(*a_, on_rim(*b_, at).x); };
    for (int k = 0; k < 40; ++k) {
      const double x = low + (high - low) / 3.0, y = high - (high - low) / 3.0;
      (beyond(x) < beyond(y) ? high : low) = beyond(x) < beyond(y) ? y : x;
    }
    const double lowest = 0.5 * (low + high);
    if (!(beyond(lowest) < 0.0)) return;
    for (const double way : {-step, step}) settle(crossing(lowest, angle + way));
  }

  // Returns an angle near the crossing between two places on the smaller circle, of which one is inside the other
  // circle's cylinder and one is outside.
  [[nodiscard]] double crossing(double one, double other) const noexcept {
    const bool inside = beyond_rim(*a_, on_rim(*b_, one).x) < 0.0;
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = 0.5 * (one + other);
      ((beyond_rim(*a_, on_rim(*b_, middle).x) < 0.0) == inside ? one : other) = middle;
    }
    return other;
  }

  void settle(double beta) noexcept {
    double alpha = nearest_angle(*a_, on_rim(*b_, beta).x);
    for (int k = 0; k < 30; ++k) {
      const OnRim p = on_rim(*a_, alpha), q = on_rim(*b_, beta);
      const Vec3 d = p.x - q.x;
      const Vec2 slope(d.dot(p.along), -d.dot(q.along));
      Eigen::Matrix2d bend;
      bend(0, 0) = p.along.squaredNorm() - a_->radius * d.dot(p.arm);
      bend(1, 1) = q.along.squaredNorm() + b_->radius * d.dot(q.arm);
      bend(0, 1) = bend(1, 0) = -p.along.dot(q.along);
      // If the squared distance isn't convex here, the matrix is changed so that the step goes downhill.
      const double least = 0.5 * (bend.trace() - std::hypot(bend(0, 0) - bend(1, 1), 2.0 * bend(0, 1)));
      if (const double wanted = 1e-12 * bend.trace(); least < wanted) {
        bend += (std::abs(least) + 0.1 * a_->radius * b_->radius) * Eigen::Matrix2d::Identity();
      }
      const Vec2 turn = bend.ldlt().solve(slope);
      const double size = turn.lpNorm<Eigen::Infinity>(), share = std::min(1.0, 0.3 / size);
      alpha -= share * turn[0];
      beta -= share * turn[1];
      if (size < 1e-15) break;
    }
    add(alpha, beta);
  }

  void add(double alpha, double beta) noexcept {
    if (!std::isfinite(alpha + beta) || count_ == angles_.size()) return;
    for (std::size_t k = 0; k < count_; ++k) {
      if (std::abs(std::remainder(angles_[k][1] - beta, 2.0 * std::numbers::pi)) < 1e-7) return;
    }
    angles_[count_++] = {alpha, beta};
  }

  bool swapped_;
  const Solid::Rim *a_, *b_;
  std::array<std::array<double, 2>, 4> angles_;
  std::size_t count_ = 0;
};

}  // namespace

std::optional<Meeting> meet_sides(const Cylinder& a, const Cylinder& b, double beside) noexcept {
  return meet_side(a, axis_of(b), b.radius, beside);
}

int meet_rim_and_side(const Cylinder& a, const Cylinder& b, std::uint32_t rim, double beside,
                      std::array<Meeting, 4>& out) noexcept {
  std::array<Vec2, 2> places;
  const int count = nearest_to_line(b.rims[rim], a.from, a.axis, places);
  int found = 0;
  for (int k = 0; k < count; ++k) {
    const Vec2& z = places[static_cast<std::size_t>(k)];
    const Solid::Rim& circle = b.rims[rim];
    const Vec3 x = circle.centre + circle.radius * (z.x() * circle.u + z.y() * circle.v);
    const std::optional<Meeting> meeting = meet_side(a, x, 0.0, beside);
    if (meeting) out[static_cast<std::size_t>(found++)] = *meeting;
  }
  return found;
}

int meet_rim_and_end(const Cylinder& a, std::uint32_t end, const Cylinder& b, std::uint32_t rim, const Vec2& level,
                     double beside, std::array<Meeting, 4>& out) noexcept {
  const Vec3 n = a.out_of_end(end);
  std::array<Vec3, 4> places;
  const int count = nearest_of_rim(FlatSide{n, n.dot(a.rims[end].centre)}, b.rims[rim], level, places);
  int found = 0;
  for (int k = 0; k < count; ++k) {
    const std::optional<Meeting> meeting = meet_end(a, end, places[static_cast<std::size_t>(k)], 0.0, beside);
    if (meeting) out[static_cast<std::size_t>(found++)] = *meeting;
  }
  return found;
}

int meet_rims(const Cylinder& a, std::uint32_t rim_a, const Cylinder& b, std::uint32_t rim_b,
              std::array<Meeting, 4>& out) noexcept {
  const NearRims near(a.rims[rim_a], b.rims[rim_b]);
  int found = 0;
  for (std::size_t k = 0; k < near.count(); ++k) {
    const OnRim p = near.on_one(k), q = near.on_other(k);
    Vec3 n = p.along.cross(q.along) / (a.radius * b.radius);
    const double sine = n.norm();
    if (!(sine > kAlong)) continue;
    const Vec3 before_a = a.out_of_end(rim_a), before_b = b.out_of_end(rim_b);
    n *= (n.dot(p.arm + before_a) < 0.0 ? -1.0 : 1.0) / sine;
    if (!out_of_rim(n, p.arm, before_a) || !out_of_rim(-n, q.arm, before_b)) continue;
    out[static_cast<std::size_t>(found++)] = {p.x, q.x, n, n.dot(q.x - p.x)};
  }
  return found;
}

double height_of_rims(const Cylinder& a, std::uint32_t rim_a, const Cylinder& b, std::uint32_t rim_b,
                      const Vec2& place) noexcept {
  const NearRims near(a.rims[rim_a], b.rims[rim_b]);
  const Vec3 wanted = place.x() * a.rims[rim_a].u + place.y() * a.rims[rim_a].v;
  double closest = -std::numeric_limits<double>::infinity(), height = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < near.count(); ++k) {
    const OnRim p = near.on_one(k), q = near.on_other(k);
    const Vec3 n = p.along.cross(q.along).normalized();
    if (!(p.arm.dot(wanted) > closest)) continue;
    closest = p.arm.dot(wanted);
    height = (n.dot(p.arm + a.out_of_end(rim_a)) < 0.0 ? -1.0 : 1.0) * n.dot(q.x - p.x);
  }
  return height;
}

double separation_of_cylinders(const Cylinder& a, const Cylinder& b) noexcept {
  double largest = -std::numeric_limits<double>::infinity();
  const auto try_along = [&](const Vec3& n) {
    const double size = n.norm();
    if (!(size > kAlong)) return;
    const Vec3 out = n / size;
    largest =
        std::max({largest, -reach_along(b, -out) - reach_along(a, out), -reach_along(a, -out) - reach_along(b, out)});
  };
  try_along(a.axis);
  try_along(b.axis);
  try_along(a.axis.cross(b.axis));
  for (const auto* pair : {&a, &b}) {
    const Cylinder &one = *pair, &other = pair == &a ? b : a;
    for (const Solid::Rim& rim : other.rims) {
      std::array<Vec2, 2> places;
      const int count = nearest_to_line(rim, one.from, one.axis, places);
      for (int k = 0; k < count; ++k) {
        const Vec2& z = places[static_cast<std::size_t>(k)];
        const Vec3 way = rim.centre + rim.radius * (z.x() * rim.u + z.y() * rim.v) - one.from;
        try_along((way - one.axis * one.axis.dot(way)).normalized());
      }
    }
  }
  for (const Solid::Rim& rim_a : a.rims) {
    for (const Solid::Rim& rim_b : b.rims) {
      const NearRims near(rim_a, rim_b);
      for (std::size_t k = 0; k < near.count(); ++k) {
        const OnRim p = near.on_one(k), q = near.on_other(k);
        try_along(p.along.normalized().cross(q.along.normalized()));
        if ((q.x - p.x).norm() > 0.0) try_along((q.x - p.x).normalized());
      }
    }
  }
  return largest;
}

}  // namespace proxarm::models
