// The steps that a device with torques may make, as sets of its joints: (23) of Kikuuwe and Fujimoto (World Haptics
// 2007) in joint space. A joint's end, a joint's speed, the tool's speed, an empty handle and a coupling that is let go
// are one law.
//
// φ(k): the links' angles as measured; c(k): the joints' proxy, which keeps to the sets; φ₁, c₁: those of k − 1; M(φ):
// the mass matrix with rotors; J: the Jacobian of T's translation. The force of (23) becomes a torque, its 𝒢 is (2):
//   φ̂(k) = φ + B(c₁ − φ₁)/(KT + B)                                      (23a)
//   c(k) = argmin ½(c − φ̂)ᵀ M (c − φ̂)   where   c − c₁ ∈ U               (23b), (2)
//   τ(k) = mean over 5 ms of (K + B/T)(c − φ̂),   K = γ M/t², B = β M/t    (23c)
// t: the longer of T and 1 ms. U, with a share of each limit, since a hand leads the steel beyond the proxy at first:
//   −T min(v, C(c₁ − c_min)) ≤ c − c₁ ≤ T min(v, C(c_max − c₁))   v = 3/4 max_speed_rad_per_s
//   |J (c − c₁)| ≤ T v_tool                                       v_tool = 2/5 max_tool_speed_m_per_s, or less
// C(d): the approach from which braking by a fifth of max_acceleration_rad_per_s2 ends within d (limits/braking.hpp).
// c_min, c_max: short of range_rad by what the drive's whole torque presses a joint into its end, τ_max t²/(γ m_i),
// with m_i = 1/(M⁻¹)_ii. A joint that starts beyond isn't driven back; it moves inwards only. With v_tool = 0 the
// joints are held where c is.
//
// - At rest a torque τ_h presses a joint by τ_h t²/(γ m_i) into its end: 14 mrad for 15 Nm on the elbow of
//   models/cells/light.yaml, within its range.
// - Inside of the sets c = φ̂, and the torque is 0, not small.
// - A wall's torque acts on its own joint: M(c − φ̂) = −Σ λ_i n_i with the rows n_i of U that are active.
// - U is convex and contains 0, so (c − c₁)ᵀτ ≤ 0 before the mean: no torque of U drives the joints' proxy.
//
// Where a drive has not that much torque, the proxy yields: with the share s that was given, c(k) = φ̂ + s (c − φ̂), out
// of its sets (Kikuuwe, IEEE Trans. Robotics 35:5, 2019, has the set-valued form). So nothing winds up: a hand that has
// overpowered a joint and lets go isn't pulled back to where it was held.
//
// A force f that the world renders may let go of the tool no faster than U's last row says (Release), and what keeps it
// takes from f alone: its multiplier is at most |f|. 25 N in 750 N/m hold 0.4 J, which would throw 0.5 kg at 1.3 m/s.
//
// Stability. M is the metric, so the loop with rigid gears has no pose in it. With the true mass matrix M_t, and
// M_t x = r M x in each mode x (M_t is M and what the hand adds, so r ≥ 1), it is that of K = γ/t², B = β/t on a mass r
// (torque_rendering.hpp), late by the mean; fewer active rows make K and B smaller in that order of matrices. But a
// gear swings: above its resonance the rotor alone answers, and a torque that is late by 1.5 T feeds what swings faster
// than 120 Hz. The mean over 5 ms has its zero at 200 Hz and turns the sign beyond. joint_coupling_test.cpp has the
// spectral radii: below 1 for rigid gears, r from 0.7 on and periods of 0.5 to 4 ms, and at 1 ms for the gears of
// models/cells/light.yaml in simulation: 200 Hz against links of 0.034 kg m² and more, on rotors of 0.06. A gear that
// swings between 70 and 180 Hz isn't borne.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/nearest_in_polyhedron.hpp"

namespace proxarm::controller {

class JointCoupling {
 public:
  static constexpr double stiffness_share = 0.012, damping_share = 0.15;  // γ, β
  static constexpr double mean_s = 5e-3, shortest_s = 1e-3;               // of (23c), and t

  // What one step may be beside the joints' and the cell's own limits.
  struct Bounds {
    double tool_speed_m_per_s = std::numeric_limits<double>::infinity();
    // Release: n·J (c − c₁) ≤ step_m, at the price of force_N.
    models::Vec3 n_W = models::Vec3::Zero();
    double step_m = 0.0, force_N = 0.0;
  };

  // Precondition: `arm` outlives this object.
  JointCoupling(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                const description::CellLimits& limits, double period_s);

  // The joints' proxy is at rest at these angles.
  void start(const models::JointVector& link_rad) noexcept;
  // One period. Returns τ(k) without what the release takes; 0 for angles that aren't finite, which change nothing. For
  // the cycle: neither allocates, locks nor throws.
  const models::JointVector& step(const models::JointVector& link_rad, const models::Jacobian& J_W,
                                  const Bounds& bounds) noexcept;

  // Tells that only this share of τ(k) was given: c(k) becomes φ̂ + s (c − φ̂).
  void yield(double share) noexcept { c_k1_ = c_hat_ + share * (c_k1_ - c_hat_); }

  // What the release takes from the force, ≥ 0.
  [[nodiscard]] double released_N() const noexcept { return released_N_; }
  // What the last step kept to. None while the joints are held.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  // How many steps the mean of (23c) is over.
  [[nodiscard]] static std::size_t mean_steps(double period_s) noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    state(c_k1_, phi_k1_, next_);
    for (Given& given : given_) state(given.torque_Nm, given.released_N);
  }

 private:
  static constexpr std::size_t most_steps = 16;
  struct Joint {
    double lower_rad, upper_rad, speed_rad_per_s, acceleration_rad_per_s2, max_torque_Nm;
  };
  struct Box {
    models::JointVector lower, upper;  // of c − c₁
  };
  struct Given {
    models::JointVector torque_Nm;
    double released_N = 0.0;
  };

  [[nodiscard]] Box box(const models::JointMatrix& M) const noexcept;
  // u(k) = c − c₁ for û = φ̂ − c₁. `price`: of the release, in units of Mu.
  [[nodiscard]] models::JointVector nearest(const models::JointVector& u_hat, const models::JointMatrix& M,
                                            const models::Jacobian& J_W, const Box& box, const Bounds& bounds,
                                            double price, double& paid) noexcept;
  [[nodiscard]] models::JointVector cut(const models::Jacobian& J_W, double tool_step_m) noexcept;
  void note_active(const models::JointVector& u, const Box& box) noexcept;
  void take_mean() noexcept;

  const models::Arm* arm_;
  std::vector<Joint> joints_;
  double tool_speed_m_per_s_, period_s_, t_s_;
  std::size_t steps_;
  models::NearestInPolyhedron program_;
  models::JointVector c_k1_, phi_k1_, torque_Nm_;
  models::JointVector c_hat_;  // φ̂ of the last step
  double released_N_ = 0.0;
  std::array<Given, most_steps> given_;
  std::uint64_t next_ = 0;
  ActiveLimits active_;
};

}  // namespace proxarm::controller
