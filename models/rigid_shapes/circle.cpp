#include "models/rigid_shapes/circle.hpp"

#include <cmath>
#include <limits>

namespace proxarm::models {
namespace {

// Returns the root of the slope g(z) = −b_x z_y + b_y z_x − D z_x z_y between the unit vectors `low` and `high`.
// Preconditions: `high` is counter-clockwise of `low` by less than half a turn; g ≥ 0 at `low` and g ≤ 0 at `high`.
// Method: Newton's method in the angle; if a step leaves the interval, the interval is halved.
Vec2 root_between(const Vec2& b, double D, Vec2 low, Vec2 high, Vec2 z) noexcept {
  const auto cross = [](const Vec2& p, const Vec2& q) { return p.x() * q.y() - p.y() * q.x(); };
  for (int k = 0; k < 80; ++k) {
    if (cross(low, z) < 0.0 || cross(z, high) < 0.0) z = (low + high).normalized();
    const double slope = -b.x() * z.y() + b.y() * z.x() - D * z.x() * z.y();
    const double bend = -b.x() * z.x() - b.y() * z.y() - D * (z.x() * z.x() - z.y() * z.y());
    if (slope == 0.0) break;
    (slope > 0.0 ? low : high) = z;
    const double turn = bend < 0.0 ? -slope / bend : std::numeric_limits<double>::infinity();
    const Vec2 last = z;
    z = std::abs(turn) < 0.5 ? Vec2((z + turn * Vec2(-z.y(), z.x())).normalized()) : Vec2((low + high).normalized());
    if ((z - last).norm() <= 2e-16) break;
  }
  return z;
}

}  // namespace

int highest_on_circle(const Vec2& b, double D, std::array<Vec2, 2>& out) noexcept {
  const Vec2 sign(b.x() < 0.0 ? -1.0 : 1.0, b.y() < 0.0 ? -1.0 : 1.0), a = b.cwiseAbs();
  const double size = std::max(a.x() + a.y(), D);
  if (!(size > 0.0)) {
    out[0] = Vec2::UnitX();
    return 1;
  }
  const Vec2 start = D > 0.0 ? Vec2(a.x() + D, a.y()).normalized() : a.normalized();
  out[0] = sign.cwiseProduct(D > 0.0 ? root_between(a, D, Vec2::UnitX(), Vec2::UnitY(), start) : start);
  if (!(a.maxCoeff() < D)) return 1;
  const Vec2 roots(std::cbrt(a.x()), std::cbrt(a.y()));
  const double reach = std::cbrt(D);
  if (!(roots.squaredNorm() < reach * reach)) return 1;
  // The second maximum is found in the mirror image at the y axis, where b_x has the opposite sign. In the mirror
  // image, the maximum lies between the x axis and the place where the slope is lowest.
  const Vec2 lowest = roots.maxCoeff() > 0.0 ? Vec2(roots.normalized()) : Vec2(Vec2::Ones().normalized());
  const Vec2 mirrored(-a.x(), a.y());
  const Vec2 z = root_between(mirrored, D, Vec2::UnitX(), lowest, Vec2(D - a.x(), a.y()).normalized());
  out[1] = sign.cwiseProduct(Vec2(-z.x(), z.y()));
  return 2;
}

}  // namespace proxarm::models
