// When a point that is looked for on tangent planes, taken again at each new point, has stopped moving.
#pragma once

#include "models/geometry.hpp"

namespace proxarm::models {

// Curved surfaces gain the factor penetration / radius with each new tangent plane, and more where they are slow.
inline constexpr int most_settling = 60;

// No closer than rounding lets it. Tiny moves (their squares, by which planes and curved surfaces differ, are nothing)
// are the last where the next one, shorter by `contraction`, would be nothing, or where they have stopped shrinking (a
// slip that is short against a deep p amplifies rounding, so a fixed threshold would not do).
inline bool has_settled(double move, double last_move, double contraction, const Vec3& r) noexcept {
  const double size = 1e-3 + r.lpNorm<1>(), nothing = 5e-17 * size;
  return move <= nothing || (move <= 1e-9 * size && (contraction * move <= nothing || move > 0.5 * last_move));
}

}  // namespace proxarm::models
