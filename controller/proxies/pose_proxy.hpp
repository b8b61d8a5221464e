// Moves the proxy of a rigid tool, a pose q, under a wrench h: (26) on SE(3).
//
//   M₆ ∇²q/T² + B₆ ∇q/T + K₆ (q ⊟ q_ref) = h + w,   w: the world's wrench, by its law at q(k)
// M₆ = diag(M, J): M for moving, J for turning. B₆ and K₆ have the same form. tool_pose.hpp defines ⊟ and moved(). With
// the twists ξ₁ = q₁ ⊟ q₂ and e₁ = q₁ ⊟ q_ref, this equation is, for small angles,
//   K = M₆/T² + B₆/T + K₆,   p̂ = moved(q₁, K⁻¹(h + M₆ ξ₁/T² − K₆ e₁))                                     (26a)
//   q = 𝒢(K, p̂, q₁),   w = K (q ⊟ p̂)                                                                (26b), (25a)
// q(k) is the pose at t_{k+1}, as in (26).
//
// The hand feels the mass and inertia of the tool behind the sensor directly. About T, where c is the tool's centre of
// mass from T, they are
//   M_h = [m E, −m [c]ₓ; m [c]ₓ, I],   w_g = (m ω × (ω × c), ω × I ω)
// The proxy has M₆ = diag(M, J) − M_h, turned with the tool. w_g, which the sensor reads if the tool turns, is added
// back. So the hand feels M in all directions and J about all axes, without coupling. K isn't diagonal then; by
// Assumption 1 contacts don't depend on K.
//
// A held orientation is the limit J → ∞, in a 𝒢 of six dimensions: p̂ keeps the orientation, and K holds the
// orientation ten thousand times as stiffly as the place, at a lever of 5 cm. With 4 kg at 1 kHz this stiffness is 1e8
// Nm/rad: while contacts press, 10 Nm turn the tool by 1e-7 rad, a tenth of the joint encoders' resolution. If K were
// much stiffer, the local problem couldn't decide how contacts on one face share their load: with 1e12 Nm/rad, 10 to 40
// % of the steps of a box lying flat found no forces.
//
// The scheme is admittance of order 1. Nothing allocates, locks, throws or prints after construction.
#pragma once

#include <cstdint>

#include "controller/proxies/proxy_step.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/pose_algorithm.hpp"

namespace proxarm::controller {

struct PoseConfig {
  double mass_kg = 4.0;         // the proxy's M: felt mass less the mass behind the sensor
  double inertia_kg_m2 = 0.05;  // J, the felt inertia
  double damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;
  double turning_damping_Nms_per_rad = 0.0, turning_spring_Nm_per_rad = 0.0;
  bool held = false;  // the orientation is held: J → ∞
  double period_s = 1e-3;
  // The tool behind the sensor. Its mass is already subtracted from mass_kg.
  double behind_mass_kg = 0.0;
  models::Vec3 behind_centre_T_m = models::Vec3::Zero();       // c: centre of mass from T, along T's axes
  models::Mat3 behind_inertia_T_kg_m2 = models::Mat3::Zero();  // I: inertia about T, along T's axes

  // Returns M₆ along T's axes.
  [[nodiscard]] models::Mat6 mass_T() const noexcept;
  // Throws description::SetupError with the option's name. M₆ must be positive definite; otherwise the tool behind the
  // sensor feels heavier than the wanted mass and inertia.
  void validate() const;
};

class PoseProxy {
 public:
  // Precondition: `g` outlives this object.
  PoseProxy(const PoseConfig& config, models::PoseAlgorithm& g);  // validates

  // Starts at rest at the pose q, at this time. q becomes the spring's reference.
  void start(const models::ToolPose& q, double time_s) noexcept;
  // Continues from q with this velocity (m/s, rad/s). The spring's reference stays. A held orientation becomes q's.
  void resume(const models::ToolPose& q, const models::Twist& velocity_W) noexcept;

  // Returns p̂ of the next step under the hand's wrench. For limits, the caller may bring p̂ nearer to q before step().
  [[nodiscard]] models::ToolPose predict(const models::Wrench& h_W) noexcept;
  // Moves the proxy for one period. A fault leaves everything unchanged.
  [[nodiscard]] ProxyFault step(const models::ToolPose& p_hat) noexcept;
  // Repeats the last step from its start with another K and p̂. Precondition: nothing in the world moves.
  [[nodiscard]] ProxyFault again(const models::Mat6& K, const models::ToolPose& p_hat) noexcept;

  [[nodiscard]] const models::ToolPose& q() const noexcept { return q_k1_; }
  [[nodiscard]] const models::ToolPose& q_before() const noexcept { return q_k2_; }  // q before the last step
  [[nodiscard]] const models::Twist& move() const noexcept { return move_; }         // q₁ ⊟ q₂ of the last step
  // The world's wrench in the last step, about T.
  [[nodiscard]] const models::Twist& wrench_W() const noexcept { return wrench_W_; }
  [[nodiscard]] const models::Mat6& K() const noexcept { return K_; }
  // The stiffness with which K holds a held orientation.
  [[nodiscard]] double holds_Nm_per_rad() const noexcept { return held_share * held_lever_m * held_lever_m * K_(0, 0); }
  [[nodiscard]] double time_s() const noexcept { return time_s_; }
  [[nodiscard]] const PoseConfig& config() const noexcept { return config_; }
  // Returns ½ vᵀ M₆ v, where v is the velocity of the last step.
  [[nodiscard]] double kinetic_J() const noexcept {
    return 0.5 * move_.dot(mass_W_ * move_) / (config_.period_s * config_.period_s);
  }
  [[nodiscard]] const models::ToolPose& reference() const noexcept { return reference_; }
  void set_reference(const models::ToolPose& reference) noexcept { reference_ = reference; }

  // Sets the parameters from the next step on. Returns false and changes nothing if a value is out of range or if M₆
  // isn't positive definite.
  bool set(const PoseConfig& changed) noexcept;
  // Precondition: the proxy is at rest.
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
