// The steps that a device with torques may make, as sets of its joints: (23) of Kikuuwe and Fujimoto (World Haptics
// 2007) in joint space. A joint's end, a joint's speed, the tool's speed and an empty handle are one law.
//
// φ(k): the links' angles as measured; c(k): the joints' proxy, which keeps to the sets; φ₁, c₁: those of k − 1; M(φ):
// the mass matrix with rotors; J: the Jacobian of T's translation. The force of (23) becomes a torque, its 𝒢 is (2):
//   φ̂(k) = φ + B(c₁ − φ₁)/(KT + B) = φ + β/(γ + β) (c₁ − φ₁)             (23a)
//   c(k) = argmin ½(c − φ̂)ᵀ M (c − φ̂)   where   c − c₁ ∈ U                (23b), (2)
//   τ(k) = (K + B/T)(c − φ̂),   K = γ M/T²,   B = β M/T                     (23c)
// U, with a share of each limit, since a hand leads the steel beyond the proxy for some milliseconds:
//   −T min(v, C(c₁ − c_min)) ≤ c − c₁ ≤ T min(v, C(c_max − c₁))   v = 3/4 max_speed_rad_per_s
//   |J (c − c₁)| ≤ T v_tool                                       v_tool = 3/4 max_tool_speed_m_per_s, or less
// C(d): the approach from which braking by half of max_acceleration_rad_per_s2 ends within d (joint_guard.hpp). A joint
// that starts beyond its end isn't driven back; it moves inwards only. With v_tool = 0 the joints are held where c is.
//
// - Inside of the sets c = φ̂, and the torque is 0, not small.
// - A wall's torque acts on its own joint: M(c − φ̂) = −Σ λ_i n_i with the rows n_i of U that are active.
// - U is convex and contains 0, so (c − c₁)ᵀτ ≤ 0: no torque of U drives the joints' proxy.
// - At rest, a torque τ_h on a joint's end gives d = τ_h T²/(γ m) with m = 1/(M⁻¹)_ii: 2.8 mrad for 15 Nm on the elbow
//   of models/cells/light.yaml (0.09 kg m²).
//
// Stability. M is the metric, so the loop has no pose in it. With the true mass matrix M_t, M_t x = r M x in each mode x
// (M_t is M and what the hand adds, so r ≥ 1; r < 1 where the model is too heavy): K and B on a mass r are the loop of
// coupling_spectral_radius() (torque_rendering.hpp), whose delay is counted there:
//   ρ(γ/T², β/T, r) < 1   for r from 0.7 to infinity; 0.87 at r = 1
// Fewer active rows make K and B smaller in that order of matrices. The gears' elasticity isn't taken into account.
#pragma once

#include <vector>

#include "controller/limits/step_limits.hpp"
#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/nearest_in_polyhedron.hpp"

namespace proxarm::controller {

class JointCoupling {
 public:
  static constexpr double stiffness_share = 0.06, damping_share = 0.35;  // γ, β

  // Precondition: `arm` outlives this object.
  JointCoupling(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                const description::CellLimits& limits, double period_s);

  // The joints' proxy is at rest at these angles.
  void start(const models::JointVector& link_rad) noexcept;
  // One period. `max_tool_speed_m_per_s`: of the tool, if lower than the cell's share; 0 holds the joints. Returns τ(k),
  // which is 0 for angles that aren't finite; these change nothing. For the cycle: neither allocates, locks nor throws.
  const models::JointVector& step(const models::JointVector& link_rad, const models::Jacobian& J_W,
                                  double max_tool_speed_m_per_s) noexcept;

  // What the last step kept to. None while the joints are held.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }

  void archive(fieldbus::StateArchive& state) noexcept { state(c_k1_, phi_k1_); }

 private:
  struct Joint {
    double lower_rad, upper_rad, speed_rad_per_s, acceleration_rad_per_s2;
  };
  struct Box {
    models::JointVector lower, upper;  // of c − c₁
  };

  [[nodiscard]] Box box() const noexcept;
  // u(k) = c − c₁ for û = φ̂ − c₁.
  [[nodiscard]] models::JointVector nearest(const models::JointVector& u_hat, const models::JointMatrix& M,
                                            const models::Jacobian& J_W, double tool_step_m) noexcept;
  void note_active(const models::JointVector& u, const Box& box, bool tool) noexcept;

  const models::Arm* arm_;
  std::vector<Joint> joints_;
  double tool_speed_m_per_s_, period_s_;
  models::NearestInPolyhedron program_;
  models::JointVector c_k1_, phi_k1_, torque_Nm_;
  ActiveLimits active_;
};

}  // namespace proxarm::controller
