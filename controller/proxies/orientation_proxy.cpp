#include "controller/proxies/orientation_proxy.hpp"

#include <algorithm>
#include <cmath>

#include "models/base/option_check.hpp"

namespace proxarm::controller {
namespace {

using models::Mat3;
using models::Vec3;

// Returns exp([φ]ₓ) as a unit quaternion. Below 1e-8 rad, sin(φ/2)/φ is ½ to the last bit of a double.
Eigen::Quaterniond rotation(const Vec3& phi) noexcept {
  const double angle = phi.norm();
  const double scale = angle < 1e-8 ? 0.5 : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q(std::cos(0.5 * angle), scale * phi.x(), scale * phi.y(), scale * phi.z());
  q.normalize();
  return q;
}

// Returns the φ of smallest norm (0 to π) with exp([φ]ₓ) = q.
Vec3 rotation_vector(const Eigen::Quaterniond& q) noexcept {
  const Vec3 axis = q.w() < 0.0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double sine = axis.norm();
  if (sine < 1e-8) return 2.0 * axis;
  return 2.0 * std::atan2(sine, std::abs(q.w())) / sine * axis;
}

bool is_unit(const Eigen::Quaterniond& R) noexcept {
  const double norm = R.norm();
  return std::isfinite(norm) && std::abs(norm - 1.0) <= 1e-6;
}

}  // namespace

void OrientationConfig::validate() const {
  require_option(is_positive(inertia_kg_m2), "orientation.inertia", inertia_kg_m2, "kg m², above 0");
  require_option(is_not_negative(spring_Nm_per_rad), "orientation.spring", spring_Nm_per_rad, "Nm/rad, 0 or more");
  require_option(is_not_negative(damping_Nms_per_rad), "orientation.damping", damping_Nms_per_rad,
                 "Nm s/rad, 0 or more");
  require_option(is_positive(turn.max_speed_rad_per_s), "orientation.max_speed", turn.max_speed_rad_per_s,
                 "rad/s, above 0");
  // The limit is less than π by more than a step, so that no step jumps past π to the limit's other side.
  require_option(is_not_negative(turn.max_turn_rad) && turn.max_turn_rad <= 3.0, "orientation.max_angle",
                 turn.max_turn_rad, "rad, from 0 to 3");
  turn.axis_range.validate();
  require_option(is_positive(period_s), "--timestep", period_s, "seconds, above 0");
  require_option(turn.max_speed_rad_per_s * period_s <= 0.1, "orientation.max_speed", turn.max_speed_rad_per_s,
                 "rad/s, at most 0.1 rad in a period");
}

OrientationProxy::OrientationProxy(const OrientationConfig& config) : config_(config) { config_.validate(); }

bool OrientationProxy::start(const Eigen::Quaterniond& R_WT) noexcept {
  if (!resume(R_WT, Vec3::Zero())) return false;
  R_ref_ = R_WT_;
  if (!started_) R_start_ = R_WT_;
  started_ = true;
  return true;
}

bool OrientationProxy::resume(const Eigen::Quaterniond& R_WT, const Vec3& omega_W) noexcept {
  if (!is_unit(R_WT) || !omega_W.allFinite()) return false;
  R_WT_ = R_WT.normalized();
  omega_W_ = omega_W;
  speed_limited_ = angle_limited_ = false;
  return true;
}

void OrientationProxy::set_inertia(double inertia_kg_m2, const Mat3& behind_sensor_T) noexcept {
  if (!is_positive(inertia_kg_m2)) return;
  config_.inertia_kg_m2 = inertia_kg_m2;
  config_.behind_sensor_T = behind_sensor_T;
}

void OrientationProxy::set_damping(double damping_Nms_per_rad) noexcept {
  if (is_not_negative(damping_Nms_per_rad)) config_.damping_Nms_per_rad = damping_Nms_per_rad;
}

void OrientationProxy::add_damping(double damping_Nms_per_rad) noexcept {
  if (is_not_negative(damping_Nms_per_rad)) added_ = damping_Nms_per_rad;
}

double OrientationProxy::kinetic_J() const noexcept {
  const Mat3 R = R_WT_.toRotationMatrix();
  const Vec3 omega_T = R.transpose() * omega_W_;
  return 0.5 * (config_.inertia_kg_m2 * omega_T.squaredNorm() - omega_T.dot(config_.behind_sensor_T * omega_T));
}

// When the spring's stiffness K becomes K', the reference moves so that the rotation vector φ from the reference
// becomes φ' with K'φ' = Kφ, which keeps the torque. If the spring becomes softer, the torque's jump can't hurt, so the
// reference stays.
void OrientationProxy::set_spring(double spring_Nm_per_rad) noexcept {
  if (!is_not_negative(spring_Nm_per_rad)) return;
  const double before = config_.spring_Nm_per_rad;
  config_.spring_Nm_per_rad = spring_Nm_per_rad;
  if (!(spring_Nm_per_rad > before)) return;
  const Vec3 phi = rotation_vector(R_WT_ * R_ref_.conjugate());
  R_ref_ = (rotation(-before / spring_Nm_per_rad * phi) * R_WT_).normalized();
}

void OrientationProxy::return_reference() noexcept {
  const Vec3 way = rotation_vector(R_start_ * R_ref_.conjugate());
  const double left = way.norm(), step = TurnSets::returning_rad_per_s * config_.period_s;
  if (left == 0.0) return;
  R_ref_ = left <= step ? R_start_ : (rotation(step / left * way) * R_ref_).normalized();
}

Mat3 OrientationProxy::impedance_W() const noexcept {
  const double T = config_.period_s;
  const Mat3 R = R_WT_.toRotationMatrix(), I = R * config_.behind_sensor_T * R.transpose();
  const double isotropic = config_.inertia_kg_m2 + T * damping_Nms_per_rad() + T * T * config_.spring_Nm_per_rad;
  return isotropic * Mat3::Identity() - I;
}

Vec3 OrientationProxy::next_velocity(const Vec3& torque_W_Nm) noexcept {
  const double J = config_.inertia_kg_m2, D = damping_Nms_per_rad(), T = config_.period_s;
  const double K = config_.spring_Nm_per_rad;
  if (K == 0.0 && config_.behind_sensor_T.isZero(0.0)) return (J * omega_W_ + T * torque_W_Nm) / (J + T * D);
  const Mat3 R = R_WT_.toRotationMatrix(), I = R * config_.behind_sensor_T * R.transpose();
  const Vec3 impulse = T * (torque_W_Nm + omega_W_.cross(Vec3(I * omega_W_)));
  const Mat3 A = (J + T * D + T * T * K) * Mat3::Identity() - I;
  return A.inverse() * (J * omega_W_ - I * omega_W_ + impulse - T * K * rotation_vector(R_WT_ * R_ref_.conjugate()));
}

ProxyFault OrientationProxy::step(const Vec3& torque_W_Nm) noexcept {
  if (!torque_W_Nm.allFinite()) return ProxyFault::input_not_finite;
  if (!config_.free) return ProxyFault::none;
  const double T = config_.period_s;
  if (config_.spring_Nm_per_rad > 0.0) return_reference();
  Vec3 omega = next_velocity(torque_W_Nm);
  if (!std::isfinite(omega.norm())) return ProxyFault::result_not_finite;
  const Vec3 unlimited = omega;

  Eigen::Quaterniond R = (rotation(T * omega) * R_WT_).normalized();
  const TurnSets::Held held = sets().keep(R_WT_, R);
  if (held.any()) omega = rotation_vector(R * R_WT_.conjugate()) / T;
  limit_torque_W_.setZero();
  if (held.any()) limit_torque_W_ = impedance_W() * (omega - unlimited) / T;
  R_WT_ = R;
  omega_W_ = omega;
  speed_limited_ = held.speed;
  angle_limited_ = held.angle;
  return ProxyFault::none;
}

}  // namespace proxarm::controller
