// As far along a straight way as an obstacle lets.
#pragma once

#include "models/obstacle.hpp"

namespace proxarm::models {

// The last point of the way from x, which is allowed, to `barred`, to which the obstacle bars it; halved until nothing
// is left between what is free and what isn't.
inline Vec3 end_of_free_way(const Obstacle& obstacle, const Vec3& x, Vec3 barred) noexcept {
  Vec3 end = x;
  for (int k = 0; k < 1100; ++k) {  // a double's exponent and digits
    const Vec3 middle = 0.5 * (end + barred);
    if (middle == end || middle == barred) break;
    (obstacle.bars(x, middle) ? barred : end) = middle;
  }
  return end;
}

}  // namespace proxarm::models
