// Solves the contact of a proxy that friction holds at a convex edge or corner of a solid.
//
// A face exerts no force beyond its edge. If the proxy comes from beside an edge, the step on each face's plane may end
// beyond the edge, although p is inside the solid. Then the edge itself holds the proxy:
// 1. The normal is between the normals of the faces: n(θ) = cos θ n₁ + sin θ n₂.
// 2. For the right θ, the step by (17) on the plane through the edge with normal n(θ) ends on the edge.
// 3. From θ = 0 to 90°, the end of this step moves from one side of the edge to the opposite side, so such a θ exists.
// 4. If Coulomb's law allows several θ, the code takes the θ whose normal is nearest to the entered face's normal.
#pragma once

#include <cmath>

#include "models/geometry/geometry.hpp"
#include "models/surfaces/layer.hpp"

namespace proxarm::models {

struct EdgeContact {
  Vec3 r;
  Vec3 normal;  // unit
  bool slips = false;
  bool found = true;  // false: r is on the edge, but doesn't satisfy (17)
};

// The data of a step that is solved on several planes.
struct StepOnPlanes {
  double mu, K;
  Layer layer;  // a copy, because a cylinder passes a temporary
  const Vec3 &p, &q;

  [[nodiscard]] FaceStep<3> on(const FlatSurface<3>& surface) const noexcept {
    return step_on_layer(surface, mu, layer, K, p, q);
  }
};

// Solves error(x) = 0 by false position (the Illinois variant), with a bisection every fourth step. Returns false
// unless error(low) > 0 and error(high) < 0. Ends when |error| ≤ `nothing` or when no double is left between low and
// high. Returns false if |error| > `near` at the end, because error(x) jumps past zero.
template <typename Error>
bool false_position(Error error, double low, double high, double nothing, double near) noexcept {
  double at_high = error(high);
  if (!(at_high < 0.0)) return false;
  double at_low = error(low);
  if (!(at_low > 0.0)) return false;
  double now = at_low;
  int side = 0;
  for (int k = 0; k < 200; ++k) {
    double x = (low * at_high - high * at_low) / (at_high - at_low);
    if (k % 4 == 3 || !(x > low && x < high)) x = 0.5 * (low + high);
    now = error(x);
    if (std::abs(now) <= nothing || !(x > low && x < high)) break;
    const int sign = now > 0.0 ? 1 : -1;
    (sign > 0 ? low : high) = x;
    (sign > 0 ? at_low : at_high) = now;
    if (sign == side) (sign > 0 ? at_high : at_low) *= 0.5;
    side = sign;
  }
  return std::abs(now) <= near;
}

// Holds the proxy at the straight edge through `point` where two faces meet at a right angle. If several normals are
// possible, takes the normal nearest to `normal_1`. Precondition: p is behind both faces, and the step on the first
// face ends beyond the edge.
EdgeContact hold_at_edge(const Vec3& point, const Vec3& normal_1, const Vec3& normal_2,
                         const StepOnPlanes& step) noexcept;

// Holds the proxy at the corner r. The proxy sticks if the normal can have the direction from r back to q. Otherwise
// the normal puts the force on the line of the friction cone that opposes the slip. Precondition: r equals neither p
// nor q.
EdgeContact hold_at_corner(const Vec3& r, double mu, const Vec3& p, const Vec3& q) noexcept;

}  // namespace proxarm::models
