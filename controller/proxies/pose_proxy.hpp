// (26) on SE(3): the proxy of a rigid tool, a pose q that moves under a wrench h.
//
//   M₆ ∇²q/T² + B₆ ∇q/T + K₆ (q ⊟ q_ref) = h + w,   w in the world's law at q(k)
// M₆ = diag(M, J), and B₆ and K₆ alike: first for moving, then for turning. ⊟ and moved() are defined in tool_pose.hpp.
// With the twists ξ₁ = q₁ ⊟ q₂ and e₁ = q₁ ⊟ q_ref this is, for small angles,
//   K = M₆/T² + B₆/T + K₆,   p̂ = moved(q₁, K⁻¹(h + M₆ ξ₁/T² − K₆ e₁))                                     (26a)
//   q = 𝒢(K, p̂, q₁),   w = K (q ⊟ p̂)                                                                (26b), (25a)
// Labels as in (26): q(k) is the pose at t_{k+1}.
//
// The hand feels the tool behind the sensor directly. About T, with c from T to the tool's centre of mass:
//   M_h = [m E, −m [c]ₓ; m [c]ₓ, I],   w_g = (m ω × (ω × c), ω × I ω)
// The proxy has M₆ = diag(M, J) − M_h, turned with the tool. w_g, which the sensor reads from a spinning handle, is
// added back. So the hand feels M in all directions and J about all axes, without coupling. This K isn't diagonal; by
// Assumption 1 contacts don't depend on it.
//
// A held orientation is J → ∞, in a 𝒢 of six dimensions: p̂ keeps the orientation, and K holds it ten thousand times as
// stiffly as the place, at 5 cm. With 4 kg at 1 kHz that is 1e8 Nm/rad: while contacts press, 10 Nm turn the tool by
// 1e-7 rad, a tenth of the joint encoders' resolution. (If K were much stiffer, the local problem couldn't tell how
// contacts on one face share their load: with 1e12 Nm/rad, 10 to 40 % of the steps of a box lying flat found no
// forces.)
//
// Scheme: admittance of order 1. No allocation, lock, exception or print after construction.
#pragma once

#include <cstdint>

#include "controller/proxies/proxy_step.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/pose_algorithm.hpp"

namespace proxarm::controller {

struct PoseConfig {
  double mass_kg = 4.0;         // M of the proxy: felt mass less the mass behind the sensor
  double inertia_kg_m2 = 0.05;  // J, as felt
  double damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;
  double turning_damping_Nms_per_rad = 0.0, turning_spring_Nm_per_rad = 0.0;
  bool held = false;  // J → ∞
  double period_s = 1e-3;
  // The tool behind the sensor. mass_kg is already without its mass.
  double behind_mass_kg = 0.0;
  models::Vec3 behind_centre_T_m = models::Vec3::Zero();       // c, along T's axes
  models::Mat3 behind_inertia_T_kg_m2 = models::Mat3::Zero();  // I about T

  // M₆ along T's axes.
  [[nodiscard]] models::Mat6 mass_T() const noexcept;
  // Throws description::SetupError with the option's name. M₆ must be positive definite; otherwise the tool behind the
  // sensor feels heavier than the wanted mass and inertia.
  void validate() const;
};

class PoseProxy {
 public:
  // Precondition: `g` outlives this object.
  PoseProxy(const PoseConfig& config, models::PoseAlgorithm& g);  // validates

  // Starts at rest at this pose and time; sets the spring's reference there.
  void start(const models::ToolPose& q, double time_s) noexcept;
  // Continues from here with this velocity (m/s, rad/s). The reference stays; a held orientation becomes that of q.
  void resume(const models::ToolPose& q, const models::Twist& velocity_W) noexcept;

  // p̂ of the next step under the hand's wrench. For limits, the caller may bring p̂ nearer to q before step().
  [[nodiscard]] models::ToolPose predict(const models::Wrench& h_W) noexcept;
  // One period. A fault leaves everything unchanged.
  [[nodiscard]] ProxyFault step(const models::ToolPose& p_hat) noexcept;
  // Repeats the last step from its start with another K and p̂. Precondition: nothing in the world moves.
  [[nodiscard]] ProxyFault again(const models::Mat6& K, const models::ToolPose& p_hat) noexcept;

  [[nodiscard]] const models::ToolPose& q() const noexcept { return q_k1_; }
  [[nodiscard]] const models::ToolPose& q_before() const noexcept { return q_k2_; }  // start of the last step
  [[nodiscard]] const models::Twist& move() const noexcept { return move_; }         // of the last step, q₁ ⊟ q₂
  // The world's wrench in the last step, about the reference point.
  [[nodiscard]] const models::Twist& wrench_W() const noexcept { return wrench_W_; }
  [[nodiscard]] const models::Mat6& K() const noexcept { return K_; }
  // Stiffness that holds a held orientation.
  [[nodiscard]] double holds_Nm_per_rad() const noexcept { return held_share * held_lever_m * held_lever_m * K_(0, 0); }
  [[nodiscard]] double time_s() const noexcept { return time_s_; }
  [[nodiscard]] const PoseConfig& config() const noexcept { return config_; }
  // ½ vᵀ M₆ v, v: velocity of the last step.
  [[nodiscard]] double kinetic_J() const noexcept {
    return 0.5 * move_.dot(mass_W_ * move_) / (config_.period_s * config_.period_s);
  }
  [[nodiscard]] const models::ToolPose& reference() const noexcept { return reference_; }
  void set_reference(const models::ToolPose& reference) noexcept { reference_ = reference; }

  // Acts from the next step on. Returns false and changes nothing if a value is out of range or makes M₆ indefinite.
  bool set(const PoseConfig& changed) noexcept;
  // Precondition: at rest.
  void set_period(double period_s) noexcept { config_.period_s = period_s; }

  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr double held_share = 1e4, held_lever_m = 0.05;

  void make_K() noexcept;
  void tell_time() noexcept;
  ProxyFault go(const models::Mat6& K, const models::ToolPose& p_hat, const models::ToolPose& from) noexcept;

  PoseConfig config_;
  models::PoseAlgorithm* g_;
  models::ToolPose q_k1_, q_k2_, reference_;
  models::Twist move_ = models::Twist::Zero(), wrench_W_ = models::Twist::Zero();
  models::Mat6 mass_W_ = models::Mat6::Identity(), K_ = models::Mat6::Identity();
  models::Vec3 centre_W_ = models::Vec3::Zero();
  models::Mat3 inertia_W_ = models::Mat3::Zero();
  double time_s_ = 0.0;
};

}  // namespace proxarm::controller
