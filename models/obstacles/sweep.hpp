// How far a point gets along a straight way before an obstacle stops it.
#pragma once

#include "models/obstacles/obstacle.hpp"

namespace proxarm::models {

// The last reachable point on the way from x to `barred`, by bisection down to neighbouring doubles. Precondition: the
// obstacle bars this way.
inline Vec3 sweep(const Obstacle& obstacle, const Vec3& x, Vec3 barred) noexcept {
  // Bisection from a metre down to the least double, 2⁻¹⁰⁷⁴ m, takes 1074 steps; about 50 are usual.
  constexpr int most_halvings = 1100;
  Vec3 end = x;
  for (int k = 0; k < most_halvings; ++k) {
    const Vec3 middle = 0.5 * (end + barred);
    if (middle == end || middle == barred) break;
    (obstacle.bars(x, middle) ? barred : end) = middle;
  }
  return end;
}

}  // namespace proxarm::models
