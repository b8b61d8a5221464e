#include "controller/proxies/orientation_proxy.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/base/option_check.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;

// exp([φ]ₓ) as a unit quaternion. Below 1e-8 rad, sin(φ/2)/φ is ½ to the last bit of double.
Eigen::Quaterniond rotation(const Vec3& phi) noexcept {
  const double angle = phi.norm();
  const double scale = angle < 1e-8 ? 0.5 : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q(std::cos(0.5 * angle), scale * phi.x(), scale * phi.y(), scale * phi.z());
  q.normalize();
  return q;
}

// The φ of the smallest norm (0..π) with exp([φ]ₓ) = q.
Vec3 rotation_vector(const Eigen::Quaterniond& q) noexcept {
  const Vec3 axis = q.w() < 0.0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double sine = axis.norm();
  if (sine < 1e-8) return 2.0 * axis;
  return 2.0 * std::atan2(sine, std::abs(q.w())) / sine * axis;
}

}  // namespace

void OrientationConfig::validate() const {
  require_option(is_positive(inertia_kg_m2), "orientation.inertia", inertia_kg_m2, "kg m², above 0");
  require_option(is_not_negative(damping_Nms_per_rad), "orientation.damping", damping_Nms_per_rad,
                 "Nm s/rad, 0 or more");
  require_option(is_positive(max_speed_rad_per_s), "orientation.max_speed", max_speed_rad_per_s, "rad/s, above 0");
  // Less than π by more than a step, so that no step can jump to the other side of the limit.
  require_option(is_not_negative(max_angle_rad) && max_angle_rad <= 3.0, "orientation.max_angle", max_angle_rad,
                 "rad, from 0 to 3");
  require_option(is_positive(period_s), "--timestep", period_s, "seconds, above 0");
  require_option(max_speed_rad_per_s * period_s <= 0.1, "orientation.max_speed", max_speed_rad_per_s,
                 "rad/s, at most 0.1 rad in a period");
}

OrientationProxy::OrientationProxy(const OrientationConfig& config) : config_(config) { config_.validate(); }

bool OrientationProxy::start(const Eigen::Quaterniond& R_WT) noexcept {
  const double norm = R_WT.norm();
  if (!std::isfinite(norm) || std::abs(norm - 1.0) > 1e-6) return false;
  R_WT_ = R_start_ = R_WT.normalized();
  omega_W_.setZero();
  speed_limited_ = angle_limited_ = false;
  return true;
}

ProxyFault OrientationProxy::step(const Vec3& torque_W_Nm) noexcept {
  if (!torque_W_Nm.allFinite()) return ProxyFault::input_not_finite;
  if (!config_.free) return ProxyFault::none;
  const double J = config_.inertia_kg_m2, D = config_.damping_Nms_per_rad, T = config_.period_s;
  Vec3 omega = (J * omega_W_ + T * torque_W_Nm) / (J + T * D);
  if (!std::isfinite(omega.norm())) return ProxyFault::result_not_finite;

  const bool too_fast = omega.norm() > config_.max_speed_rad_per_s;
  if (too_fast) omega *= config_.max_speed_rad_per_s / omega.norm();
  Eigen::Quaterniond R = (rotation(T * omega) * R_WT_).normalized();

  // With R = exp([φ]ₓ) R_start, ‖φ‖ ≤ max_angle. A step that leaves this set is projected onto its border (the nearest
  // orientation with the same axis), and the velocity is that of the actual rotation.
  const Vec3 phi = rotation_vector(R * R_start_.conjugate());
  const bool too_far = phi.norm() > config_.max_angle_rad;
  if (too_far) {
    R = (rotation(config_.max_angle_rad / phi.norm() * phi) * R_start_).normalized();
    omega = rotation_vector(R * R_WT_.conjugate()) / T;
  }
  R_WT_ = R;
  omega_W_ = omega;
  speed_limited_ = too_fast;
  angle_limited_ = too_far;
  return ProxyFault::none;
}

}  // namespace proxarm::controller
