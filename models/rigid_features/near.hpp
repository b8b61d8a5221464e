// How near features are, and which of them may hold each other: first looks, for gathering pairs.
#pragma once

#include <algorithm>
#include <cstdint>

#include "models/mesh/mesh.hpp"
#include "models/rigid_shapes/solid.hpp"
#include "models/rigid_shapes/touch.hpp"

namespace proxarm::models {

inline double distance2_to_segment(const Vec3& p, const EdgeLine& edge) noexcept {
  const Vec3 along = edge.to - edge.from;
  const double s = std::clamp(along.dot(p - edge.from) / along.squaredNorm(), 0.0, 1.0);
  return (p - edge.from - s * along).squaredNorm();
}

inline double distance2_to_box(const Vec3& p, const Bounds& box) noexcept {
  return (box.low - p).cwiseMax(p - box.high).cwiseMax(0.0).squaredNorm();
}

double distance2_of_segments(const EdgeLine& a, const EdgeLine& b) noexcept;

// Whether two sharp edges can't hold each other at any pose that is turned by up to `turn` (rad) from this one.
bool never_hold(const EdgeLine& own, const EdgeLine& other, double turn) noexcept;

// By how much a corner and a face may turn until they touch, for the corner's cone of normals. Either may, and normals
// of narrow faces are known to askew_rad only.
inline NormalCone::Angle turn_of_corners(double turn) noexcept { return NormalCone::Angle::of(askew_rad + 2.0 * turn); }

// The square of what a point is at least away from a triangle, or from a face of a solid: by its height, and by how far
// its foot lies beyond one of the sides. Beyond `near` it is infinite.
double distance2_within(const TriangleMesh& mesh, std::uint32_t index, const Vec3& p, double near) noexcept;
double distance2_within(const Solid& solid, const Solid::Face& face, const Vec3& p, double near) noexcept;

}  // namespace proxarm::models
