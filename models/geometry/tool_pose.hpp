// The pose of a rigid tool, and the changes of poses on SE(3) as twists.
//
//   moved(b, ξ) = (x_b + ξ_x, exp(ξ_θ) R_b)
//   a ⊟ b       = (x_a − x_b, log(R_a R_bᵀ)),  so that moved(b, a ⊟ b) = a
//
// Translation and rotation are separate: x is the position of the tool's reference point, and a rotation turns the tool
// about this point. Everything is in W, in metres and radians.
#pragma once

#include <cmath>
#include <limits>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

using Quaternion = Eigen::Quaterniond;
using Twist = Vec<6>;  // translation (m), then rotation (rad); as a wrench: force (N), then torque (Nm)

struct ToolPose {
  Vec3 position = Vec3::Zero();                     // position of the reference point
  Quaternion orientation = Quaternion::Identity();  // unit quaternion, from T to W

  // Transforms a point of the tool from T to W.
  [[nodiscard]] Vec3 operator*(const Vec3& point_T) const noexcept { return position + orientation * point_T; }
  [[nodiscard]] bool operator==(const ToolPose& other) const noexcept {
    return position == other.position && orientation.coeffs() == other.orientation.coeffs();
  }
};

// Returns the rotation by the angle ‖θ‖ about the axis θ; θ in rad.
inline Quaternion rotation_by(const Vec3& theta) noexcept {
  const double half = 0.5 * theta.norm();
  // This is sin(x)/x for x = half. Below 1e-4 rad the next term of the series, x⁴/120, is smaller than rounding.
  const double shrink = half < 1e-4 ? 1.0 - half * half / 6.0 : std::sin(half) / half;
  const Vec3 v = 0.5 * shrink * theta;
  return {std::cos(half), v.x(), v.y(), v.z()};
}

// The inverse of rotation_by(), with ‖θ‖ ≤ π. The result is exact to rounding, also for angles near 0 and near π.
inline Vec3 rotation_vector(const Quaternion& rotation) noexcept {
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const double s = rotation.vec().norm(), c = sign * rotation.w();
  // The factor is 2 atan(s/c)/s. For small t = s/c it is (2/c)(1 − t²/3 + t⁴/5), and t⁴ is smaller than rounding if t <
  // 1e-4.
  const double t = s / c;
  const double stretch = s < 1e-4 * c ? 2.0 / c * (1.0 - t * t / 3.0) : 2.0 * std::atan2(s, c) / s;
  return sign * stretch * rotation.vec();
}

// Returns the shortest rotation from UnitZ to `direction`, which may have any length but 0. For −UnitZ the rotation
// turns about −UnitX. The result equals Eigen's Quaternion::FromTwoVectors(UnitZ, direction), which takes ten seconds
// to compile in every source that uses it.
Quaternion rotation_from_z(const Vec3& direction) noexcept;

// Returns a ⊟ b.
inline Twist difference(const ToolPose& a, const ToolPose& b) noexcept {
  Twist xi;
  xi << a.position - b.position, rotation_vector(a.orientation * b.orientation.conjugate());
  return xi;
}

// Returns moved(pose, ξ). The orientation is normalised again, so that rounding errors don't accumulate over steps.
inline ToolPose moved(const ToolPose& pose, const Twist& xi) noexcept {
  return {pose.position + xi.head<3>(), (rotation_by(xi.tail<3>()) * pose.orientation).normalized()};
}

inline Pose isometry(const ToolPose& pose) noexcept {
  Pose X = Pose::Identity();
  X.linear() = pose.orientation.toRotationMatrix();
  X.translation() = pose.position;
  return X;
}

inline ToolPose tool_pose(const Pose& X) noexcept { return {X.translation(), Quaternion(X.linear()).normalized()}; }

}  // namespace proxarm::models
