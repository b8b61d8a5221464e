#include "models/corner.hpp"

#include <array>

#include "models/cone_sum.hpp"

namespace proxarm::models {

CornerPoint::CornerPoint(const FlatSurface<3>& a, const FlatSurface<3>& b, const FlatSurface<3>& c) noexcept {
  const Vec3 bc = b.normal().cross(c.normal()), ca = c.normal().cross(a.normal()), ab = a.normal().cross(b.normal());
  const double volume = a.normal().dot(bc);
  // The triple product of unit vectors is rounded by a few 1e-16.
  exists = std::abs(volume) > 1e-14;
  if (!exists) return;
  dual.row(0) = bc / volume;
  dual.row(1) = ca / volume;
  dual.row(2) = ab / volume;
  x0 = (a.point() + b.point() + c.point()) / 3.0;
  for (int k = 0; k < 3; ++k) x0 = settle(a, b, c, x0);
}

CornerSolution solve_corner(const FlatSurface<3>* const surface[3], const double mu[3], const CornerPoint& corner,
                            const Vec3& p, const Vec3* const q[3]) noexcept {
  CornerSolution out;
  if (!corner.exists) return out;
  const Vec3 f = corner.x0 - p;
  std::array<ForceCone, 3> cones;
  bool at_rest = true, in_place = true;
  double rounding = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3& n = surface[i]->normal();
    const Vec3 d = corner.x0 - *q[i], v = d - n * n.dot(d);
    const double speed = v.norm(), own_rounding = surface[i]->rounding(*q[i]) + surface[i]->rounding(p);
    rounding += own_rounding;
    in_place = in_place && surface[i]->holds(*q[i]);
    // The corner itself is known to its rounding over the angle between faces, which the dual basis measures.
    const bool rests = speed <= own_rounding * corner.dual.norm();
    out.slips[i] = !rests && mu[i] > 0.0;
    at_rest = at_rest && rests;
    if (rests || !(mu[i] > 0.0)) {
      cones[i] = {n, rests ? mu[i] : 0.0};
    } else {
      cones[i] = {(n - mu[i] / speed * v).normalized(), 0.0};
    }
  }
  const double tolerance = rounding * corner.dual.norm();
  // Inside the cone of the normals no friction is needed; where all rest that is the most common case, and cheap.
  const Vec3 shares = corner.dual * f;
  out.found = (at_rest && shares.minCoeff() >= 0.0) || in_sum_of_cones(f, cones, tolerance);
  // Sticks in the corner: bit for bit, if it was there.
  out.r = at_rest && in_place && *q[0] == *q[1] && *q[0] == *q[2] ? *q[0] : corner.x0;
  return out;
}

}  // namespace proxarm::models
