// Computes the tool's orientation: held, or turning freely with an inertia, a damping and a spring. A held orientation
// is the limit J → ∞.
//
//   J dω/dt + Dω + K φ = τ,  dR/dt = [ω]ₓ R,  R = exp([φ]ₓ) R_ref     J, D, K: scalars, equal about all axes
//   ω(k) = (J + T D + T² K)⁻¹ (J ω(k−1) + T τ(k) − T K φ(k−1))        implicit in D and K, so stable at any size
//   R(k) = exp([T ω(k)]ₓ) R(k−1)
// For small angles these equations are (26) with B and K_v, and R(k) is the orientation at t_{k+1}, as in (26). Without
// damping a constant torque gives the exact parabola of angles; with damping ω tends to τ/D for any T.
//
// The hand feels the inertia I of the tool behind the sensor directly, besides J. I is about the rendered point and
// turns with the tool. So J E − R I Rᵀ replaces J, and the gyroscopic torque ω × R I Rᵀ ω, which the sensor reads, is
// added back. The hand then feels J about every axis. A centre of mass that isn't at the rendered point also couples
// turning with moving. This class, for a point tool, neglects this coupling; pose_proxy.hpp, for a rigid tool, doesn't.
//
// Limits: the motion is projected onto the sets of turning (turn_sets.hpp), whose angles count from the orientation at
// the first start. The projected motion becomes the history, so nothing winds up.
//
// The spring's reference R_ref is the orientation at the first start. When the spring becomes stiffer, R_ref jumps to
// the orientation that keeps the spring's torque. After a hold, R_ref jumps to the present orientation, where the
// spring's torque is zero. R_ref then returns at TurnSets::returning_rad_per_s.
//
// τ: torque about the rendered point, in W. R_WT remains a unit quaternion. One caller at a time. step() may be called
// in the cycle: it doesn't allocate, lock, throw or print.
#pragma once

#include <cstdint>

#include "controller/proxies/proxy_step.hpp"
#include "controller/proxies/turn_sets.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct OrientationConfig {
  bool free = false;                                    // false: the tool keeps its orientation at the start
  double inertia_kg_m2 = 0.05;                          // J > 0, the felt inertia; larger than I about every axis
  models::Mat3 behind_sensor_T = models::Mat3::Zero();  // I, about the rendered point, along T's axes; kg m²
  double damping_Nms_per_rad = 0.5;                     // D ≥ 0
  double spring_Nm_per_rad = 0.0;                       // K ≥ 0
  TurnSets turn{};         // speed > 0, at most 0.1 rad per period; angles count from the first start
  double period_s = 1e-3;  // T > 0

  // Throws description::SetupError with the key's name.
  void validate() const;
};

class OrientationProxy {
 public:
  explicit OrientationProxy(const OrientationConfig& config);  // validates

  // Precondition: the configuration with this period passes validate().
  void set_period(double period_s) noexcept { config_.period_s = period_s; }
  // Starts at rest at R_WT. If R_WT isn't a unit quaternion within 1e-6, returns false and changes nothing. The range
  // of angles counts from the first start; later starts follow a hold.
  bool start(const Eigen::Quaterniond& R_WT) noexcept;
  // Makes the range of angles count from R_WT, instead of the orientation at the first start.
  void count_from(const Eigen::Quaterniond& R_WT) noexcept {
    R_start_ = R_WT;
    started_ = true;
  }
  // Call if the arm couldn't follow: the motion continues from R_WT with this angular velocity.
  bool resume(const Eigen::Quaterniond& R_WT, const models::Vec3& omega_W) noexcept;
  // The setters act from the next step on, without a jump. A value out of range changes nothing.
  void set_inertia(double inertia_kg_m2, const models::Mat3& behind_sensor_T) noexcept;
  void set_damping(double damping_Nms_per_rad) noexcept;
  void set_spring(double spring_Nm_per_rad) noexcept;
  // Sets the damping that is added to D from the next step on (passivity.hpp).
  void add_damping(double damping_Nms_per_rad) noexcept;
  // Limits the speed to a share of its limit, 0 to 1, while the tool is slowed.
  void limit_speed(double share) noexcept { speed_share_ = share; }
  // Turns the tool for one period under the torque τ(k). A fault leaves everything unchanged.
  [[nodiscard]] ProxyFault step(const models::Vec3& torque_W_Nm) noexcept;

  [[nodiscard]] const Eigen::Quaterniond& R_WT() const noexcept { return R_WT_; }
  [[nodiscard]] const models::Vec3& velocity_W() const noexcept { return omega_W_; }  // rad/s, mean over the last step
  // D plus the added damping.
  [[nodiscard]] double damping_Nms_per_rad() const noexcept { return config_.damping_Nms_per_rad + added_; }
  [[nodiscard]] double kinetic_J() const noexcept;
  // The limits' torque in the last step.
  [[nodiscard]] const models::Vec3& limit_torque_W() const noexcept { return limit_torque_W_; }
  // Whether the speed limit was active in the last step.
  [[nodiscard]] bool speed_limited() const noexcept { return speed_limited_; }
  // Whether a limit of an angle was active in the last step.
  [[nodiscard]] bool angle_limited() const noexcept { return angle_limited_; }
  [[nodiscard]] const OrientationConfig& config() const noexcept { return config_; }
  void archive(fieldbus::StateArchive& state) noexcept {
    state(R_WT_, R_start_, R_ref_, omega_W_, speed_share_, started_, config_.inertia_kg_m2, config_.behind_sensor_T,
          config_.damping_Nms_per_rad, config_.spring_Nm_per_rad, added_);
  }

  // Returns the sets of turning for the next step.
  [[nodiscard]] TurnSets sets() const noexcept {
    TurnSets sets = config_.turn;
    sets.home = R_start_;
    sets.max_speed_rad_per_s *= speed_share_;
    sets.period_s = config_.period_s;
    return sets;
  }

 private:
  // Returns (J + T D + T² K) E − R I Rᵀ.
  [[nodiscard]] models::Mat3 impedance_W() const noexcept;
  [[nodiscard]] models::Vec3 next_velocity(const models::Vec3& torque_W_Nm) noexcept;
  void return_reference() noexcept;

  OrientationConfig config_;
  Eigen::Quaterniond R_WT_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond R_start_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond R_ref_ = Eigen::Quaterniond::Identity();
  models::Vec3 omega_W_ = models::Vec3::Zero(), limit_torque_W_ = models::Vec3::Zero();
  double speed_share_ = 1.0, added_ = 0.0;
  bool started_ = false;
  bool speed_limited_ = false, angle_limited_ = false;
};

}  // namespace proxarm::controller
