#include "models/surfaces/corner.hpp"

#include "models/surfaces/cone_sum.hpp"

namespace proxarm::models {

CornerPoint::CornerPoint(const FlatSurface<3>& a, const FlatSurface<3>& b, const FlatSurface<3>& c) noexcept {
  const Vec3 bc = b.normal().cross(c.normal()), ca = c.normal().cross(a.normal()), ab = a.normal().cross(b.normal());
  const double volume = a.normal().dot(bc);
  // The triple product of the unit normals has a rounding error of a few 1e-16. If the triple product is below 1e-14,
  // the corner's position has less than two correct digits.
  exists = std::abs(volume) > 1e-14;
  if (!exists) return;
  dual.row(0) = bc / volume;
  dual.row(1) = ca / volume;
  dual.row(2) = ab / volume;
  x0 = (a.point() + b.point() + c.point()) / 3.0;
  for (int k = 0; k < 3; ++k) x0 = settle(a, b, c, x0);
}

CornerSolution solve_corner(const std::array<PlaneContact, 3>& contacts, const CornerPoint& corner,
                            const Vec3& p) noexcept {
  CornerSolution out;
  if (!corner.exists) return out;
  const Vec3 f = corner.x0 - p;
  std::array<ForceCone, 3> cones;
  bool at_rest = true, in_place = true;
  double rounding = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [surface, mu, q] = contacts[i];
    const Vec3& n = surface.normal();
    const Vec3 d = corner.x0 - q, v = d - n * n.dot(d);
    const double speed = v.norm(), own_rounding = surface.rounding(q) + surface.rounding(p);
    rounding += own_rounding;
    in_place = in_place && surface.holds(q);
    // The corner's position is uncertain by the rounding of the heights times ‖dual‖; ‖dual‖ grows as one over the
    // angle between the faces.
    const bool rests = speed <= own_rounding * corner.dual.norm();
    out.slips[i] = !rests && mu > 0.0;
    at_rest = at_rest && rests;
    if (rests || !(mu > 0.0)) {
      cones[i] = {n, rests ? mu : 0.0};
    } else {
      cones[i] = {(n - mu / speed * v).normalized(), 0.0};
    }
  }
  const double tolerance = rounding * corner.dual.norm();
  // A force in the cone of the normals needs no friction. For three resting contacts this cheap test usually suffices.
  const Vec3 shares = corner.dual * f;
  out.found = (at_rest && shares.minCoeff() >= 0.0) || in_sum_of_cones(f, cones, tolerance);
  // A proxy that was in the corner and sticks there is returned unchanged, bit for bit.
  const Vec3& q = contacts[0].q;
  out.r = at_rest && in_place && q == contacts[1].q && q == contacts[2].q ? q : corner.x0;
  return out;
}

}  // namespace proxarm::models
