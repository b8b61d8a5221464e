// Contact at a convex edge or corner of a solid where friction holds the proxy.
//
// A face's plane holds nothing beyond the face's edge. For a proxy that comes from beside an edge, the step on each of
// the two planes may end beyond the edge, although p is inside. The edge itself then holds the proxy, with a normal
// between those of the faces, n(θ) = cos θ n₁ + sin θ n₂: the one for which (17), on the plane through the edge, ends
// on the edge. From θ = 0 to 90° that end moves from one side of the edge to the other, so such a θ exists. Coulomb's
// law allows several; the one nearest to the entered face is taken.
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
  Layer layer;  // a copy: a cylinder passes a temporary
  const Vec3 &p, &q;

  [[nodiscard]] FaceStep<3> on(const FlatSurface<3>& surface) const noexcept {
    return step_on_layer(surface, mu, layer, K, p, q);
  }
};

// Solves error(x) = 0 by false position (the Illinois variant) with a bisection every fourth step. Expects error > 0 at
// low and error < 0 at high, and returns false otherwise. Ends when |error| ≤ `nothing` or no double is left between.
// Returns false if error(x) jumps past zero by more than `near`.
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

// Holds the proxy at the straight edge through `point` where two faces meet at a right angle, with the normal nearest
// to the first face's. Precondition: p is behind both faces, and the step on the first ends beyond the edge.
EdgeContact hold_at_edge(const Vec3& point, const Vec3& normal_1, const Vec3& normal_2,
                         const StepOnPlanes& step) noexcept;

// Holds the proxy at the corner r. It sticks if the direction back to q can be the normal. Otherwise the normal puts
// the force on the edge of the friction cone, against the slip. Precondition: r is neither p nor q.
EdgeContact hold_at_corner(const Vec3& r, double mu, const Vec3& p, const Vec3& q) noexcept;

}  // namespace proxarm::models
