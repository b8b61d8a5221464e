// The tool's orientation: it is held, or it turns freely with an inertia and a damping of its own.
//
//   J dω/dt + Dω = τ,  dR/dt = [ω]ₓ R     J, D scalars: a ball, so no gyroscopic terms and no preferred axis
//   ω(k) = (J ω(k−1) + T τ(k)) / (J + T D)          implicit in D: no damping is too strong
//   R(k) = exp([T ω(k)]ₓ) R(k−1)
// For small angles this is (26) with B, its label included: R(k) is the orientation at t_{k+1}. Without damping a
// constant torque gives the exact parabola of angles; with it ω tends to τ/D for any T.
//
// Two limits, neither of which depends on T: the speed, and the angle from the orientation at the start. They are sets
// onto which the motion is projected. The projected motion becomes the history, so nothing winds up.
//
// τ is the torque about the rendered point, in W; R_WT is a quaternion that is kept unit. One caller at a time. step()
// is for the cycle: it neither allocates, locks, throws nor prints.
#pragma once

#include <cstdint>

#include "controller/proxies/proxy_step.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct OrientationConfig {
  bool free = false;                 // false: held as it was at the start
  double inertia_kg_m2 = 0.05;       // J > 0
  double damping_Nms_per_rad = 0.5;  // D ≥ 0
  double max_speed_rad_per_s = 2.0;  // > 0, at most 0.1 rad in a period
  double max_angle_rad = 0.7;        // from the orientation at the start; 0..3
  double period_s = 1e-3;            // T > 0

  // Throws description::SetupError that names the key.
  void validate() const;
};

class OrientationProxy {
 public:
  explicit OrientationProxy(const OrientationConfig& config);  // validates

  // Precondition: the configuration with this period passes validate().
  void set_period(double period_s) noexcept { config_.period_s = period_s; }
  // Starts at rest at R. If R isn't a unit quaternion to within 1e-6, returns false and changes nothing.
  bool start(const Eigen::Quaterniond& R_WT) noexcept;
  // One period under the torque τ(k). After a fault nothing has changed.
  [[nodiscard]] ProxyFault step(const models::Vec3& torque_W_Nm) noexcept;

  [[nodiscard]] const Eigen::Quaterniond& R_WT() const noexcept { return R_WT_; }
  [[nodiscard]] const models::Vec3& velocity_W() const noexcept { return omega_W_; }  // rad/s, mean over the last step
  [[nodiscard]] bool speed_limited() const noexcept { return speed_limited_; }        // in the last step
  [[nodiscard]] bool angle_limited() const noexcept { return angle_limited_; }
  [[nodiscard]] const OrientationConfig& config() const noexcept { return config_; }
  void archive(fieldbus::StateArchive& state) noexcept { state(R_WT_, R_start_, omega_W_); }

 private:
  OrientationConfig config_;
  Eigen::Quaterniond R_WT_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond R_start_ = Eigen::Quaterniond::Identity();
  models::Vec3 omega_W_ = models::Vec3::Zero();
  bool speed_limited_ = false, angle_limited_ = false;
};

}  // namespace proxarm::controller
