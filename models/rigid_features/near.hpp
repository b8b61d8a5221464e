// Quick tests for gathering pairs: how near two features are, and whether they may hold each other.
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

// True only if two sharp edges can't hold each other at any pose that is turned by up to `turn` (rad) from the present
// pose.
bool never_hold(const EdgeLine& own, const EdgeLine& other, double turn) noexcept;

// Returns the angle by which the cone of a corner must be widened if each body may turn by `turn` (rad) before the
// corner touches a face. Both bodies may turn, hence twice `turn`. The normals of narrow faces are known only to
// askew_rad.
inline NormalCone::Angle turn_of_corners(double turn) noexcept { return NormalCone::Angle::of(askew_rad + 2.0 * turn); }

// Return the square of a lower bound of the distance between a point and a triangle, or between a point and a face of a
// solid. The bound consists of the point's height over the plane and of the distance by which its foot lies beyond one
// of the face's sides. The result is infinite if the bound exceeds `near`.
double distance2_within(const TriangleMesh& mesh, std::uint32_t index, const Vec3& p, double near) noexcept;
double distance2_within(const Solid& solid, const Solid::Face& face, const Vec3& p, double near) noexcept;

}  // namespace proxarm::models
