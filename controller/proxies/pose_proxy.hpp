// (26) on SE(3): the proxy of a rigid tool, a pose q that moves under a wrench h.
//
//   M₆ ∇²q/T² + B₆ ∇q/T + K₆ (q ⊟ q_ref) = h + w,   w in the world's law at q(k)
// M₆ = diag(M, J), and so B₆ and K₆: masses and stiffnesses of the place, then those of turning. ⊟ and moved() are
// tool_pose.hpp's. With the twists ξ₁ = q₁ ⊟ q₂ and e₁ = q₁ ⊟ q_ref this is
//   K = M₆/T² + B₆/T + K₆,   p̂ = moved(q₁, K⁻¹(h + M₆ ξ₁/T² − K₆ e₁))                                     (26a)
//   q = 𝒢(K, p̂, q₁),   w = K (q ⊟ p̂)                                                                (26b), (25a)
// For small angles, that is. Its labels are those of (26): q(k) is the pose at t_{k+1}.
//
// What hangs behind the sensor is felt by itself. About T, with c from T to its centre of mass:
//   M_h = [m E, −m [c]ₓ; m [c]ₓ, I],   w_g = (m ω × (ω × c), ω × I ω)
// The proxy has M₆ = diag(M, J) − M_h, turned with the tool, and gets back w_g, which the sensor reads of a handle that
// spins. So what the hand feels is M in all directions and J about all axes, without coupling. This K isn't diagonal;
// Assumption 1 is what makes contacts indifferent to it.
//
// An orientation that is held is J → ∞, in a 𝒢 of six dimensions: p̂ keeps the orientation that is held, and K holds it
// ten thousand times as stiffly as the place, at 5 cm. With 4 kg at 1 kHz that is 1e8 Nm/rad: contacts turn the tool by
// 1e-7 rad for 10 Nm, a tenth of what joints' encoders resolve, and as long as they press. (Much stiffer, and the local
// problem can't tell how contacts on one face share their load: with 1e12 Nm/rad a tenth to four tenths of the steps of
// a box that lies flat found no forces.)
//
// Scheme: admittance of order 1. Neither allocates, locks, throws nor prints after construction.
#pragma once

#include <cstdint>

#include "controller/proxies/proxy_step.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/pose_algorithm.hpp"

namespace proxarm::controller {

struct PoseConfig {
  double mass_kg = 4.0;         // M of the proxy: the felt one, less what hangs behind the sensor
  double inertia_kg_m2 = 0.05;  // J, the felt one
  double damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;
  double turning_damping_Nms_per_rad = 0.0, turning_spring_Nm_per_rad = 0.0;
  bool held = false;  // J → ∞
  double period_s = 1e-3;
  // What hangs behind the sensor: its mass is in mass_kg already.
  double behind_mass_kg = 0.0;
  models::Vec3 behind_centre_T_m = models::Vec3::Zero();       // c, along T's axes
  models::Mat3 behind_inertia_T_kg_m2 = models::Mat3::Zero();  // I about T

  // M₆ along T's axes.
  [[nodiscard]] models::Mat6 mass_T() const noexcept;
  // Throws description::SetupError that names the option. M₆ must be positive definite: else what hangs behind the
  // sensor is felt as more than was asked for.
  void validate() const;
};

class PoseProxy {
 public:
  // Precondition: `g` outlives this object.
  PoseProxy(const PoseConfig& config, models::PoseAlgorithm& g);  // validates

  // At rest at this pose, at this time; the spring's reference is there, too.
  void start(const models::ToolPose& q, double time_s) noexcept;
  // The motion goes on from here with this velocity (m/s, rad/s). The reference stays; an orientation that is held is
  // held as it is here.
  void resume(const models::ToolPose& q, const models::Twist& velocity_W) noexcept;

  // p̂ of the next step under the hand's wrench; the caller may bring it nearer to q (limits) before step().
  [[nodiscard]] models::ToolPose predict(const models::Wrench& h_W) noexcept;
  // One period. After a fault nothing has changed.
  [[nodiscard]] ProxyFault step(const models::ToolPose& p_hat) noexcept;
  // The last step once more, from where it began, by another K and p̂. Precondition: nothing in the world moves.
  [[nodiscard]] ProxyFault again(const models::Mat6& K, const models::ToolPose& p_hat) noexcept;

  [[nodiscard]] const models::ToolPose& q() const noexcept { return q_k1_; }
  [[nodiscard]] const models::ToolPose& q_before() const noexcept { return q_k2_; }  // where the last step began
  [[nodiscard]] const models::Twist& move() const noexcept { return move_; }         // of the last step, q₁ ⊟ q₂
  // The world's wrench in the last step, about the reference point.
  [[nodiscard]] const models::Twist& wrench_W() const noexcept { return wrench_W_; }
  [[nodiscard]] const models::Mat6& K() const noexcept { return K_; }
  // How stiffly an orientation is held.
  [[nodiscard]] double holds_Nm_per_rad() const noexcept { return held_share * held_lever_m * held_lever_m * K_(0, 0); }
  [[nodiscard]] double time_s() const noexcept { return time_s_; }
  [[nodiscard]] const PoseConfig& config() const noexcept { return config_; }
  // ½ of the last step's velocity times M₆ times it.
  [[nodiscard]] double kinetic_J() const noexcept {
    return 0.5 * move_.dot(mass_W_ * move_) / (config_.period_s * config_.period_s);
  }
  [[nodiscard]] const models::ToolPose& reference() const noexcept { return reference_; }
  void set_reference(const models::ToolPose& reference) noexcept { reference_ = reference; }

  // Take effect with the next step. What would make M₆ indefinite, or is out of range, changes nothing (false).
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
