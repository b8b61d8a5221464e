// The motion of an object that moves by a fixed script, as a function of time.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// A scripted motion: a turn about the point c, a shift and a swing. The motion is relative to the pose in which the
// scene describes the object.
//   x(t) = c + R(ω t) (x − c) + v t + a sin(2π f t + φ)
struct ScriptedMotion {
  Vec3 velocity_m_per_s = Vec3::Zero();
  Vec3 amplitude_m = Vec3::Zero();
  double frequency_Hz = 0.0;
  double phase_rad = 0.0;
  Vec3 axis = Vec3::UnitZ();  // unit
  Vec3 centre_m = Vec3::Zero();
  double turn_rad_per_s = 0.0;

  [[nodiscard]] Pose at(double time_s) const noexcept {
    Pose X = Pose::Identity();
    X.linear() = Eigen::AngleAxisd(turn_rad_per_s * time_s, axis).toRotationMatrix();
    X.translation() = centre_m - X.linear() * centre_m + velocity_m_per_s * time_s +
                      amplitude_m * std::sin(2.0 * std::numbers::pi * frequency_Hz * time_s + phase_rad);
    return X;
  }
};

// Orthonormalises the rotation by two passes of Gram–Schmidt. Returns X itself if its rotation is orthonormal within
// rounding.
inline Pose orthonormalised(Pose X) noexcept {
  auto R = X.linear();
  const double off = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(off > 8.0 * std::numeric_limits<double>::epsilon())) return X;
  for (int pass = 0; pass < 2; ++pass) {
    R.col(0).normalize();
    R.col(1) = (R.col(1) - R.col(0) * R.col(0).dot(R.col(1))).normalized();
    R.col(2) = R.col(0).cross(R.col(1));
  }
  return X;
}

// Whether this step follows the last step directly: t − T equals the time of the last step within rounding. If so, the
// callers reuse the last step's pose, bit for bit.
inline bool follows(double time_s, double period_s, double last_time_s) noexcept {
  const double rounding_s = 4.0 * std::numeric_limits<double>::epsilon() * (std::abs(time_s) + period_s);
  return std::abs(time_s - period_s - last_time_s) <= rounding_s;
}

}  // namespace proxarm::models
