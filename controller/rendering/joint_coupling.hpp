// The limits of a device with torques, as sets of joint steps: (23) of Kikuuwe and Fujimoto (World Haptics 2007) in
// joint space. One law covers joint ranges, joint speeds, the tool's speed, an empty handle and the release of a
// coupling.
//
// φ(k): measured link angles; c(k): the joints' proxy, which keeps to the sets; φ₁, c₁: those of k − 1; M(φ): mass
// matrix with rotors; J: Jacobian of T's translation. The force of (23) becomes a torque, its 𝒢 is (2):
//   φ̂(k) = φ + B(c₁ − φ₁)/(KT + B)                                      (23a)
//   c(k) = argmin ½(c − φ̂)ᵀ M (c − φ̂)   where   c − c₁ ∈ U               (23b), (2)
//   τ(k) = mean over 5 ms of (K + B/T)(c − φ̂),   K = γ M/t², B = β M/t    (23c)
// t: the longer of T and 1 ms. U uses a share of each limit, since a hand first moves the arm beyond the proxy:
//   −T min(v, C(c₁ − c_min)) ≤ c − c₁ ≤ T min(v, C(c_max − c₁))   v = 3/4 max_speed_rad_per_s
//   |J (c − c₁)| ≤ T v_tool                                       v_tool = 2/5 max_tool_speed_m_per_s, or less
// C(d): speed from which braking with a fifth of max_acceleration_rad_per_s2 ends within d (limits/braking.hpp). c_min,
// c_max: range_rad, less the distance by which the drive's full torque presses a joint into its end, τ_max t²/(γ m_i),
// m_i = 1/(M⁻¹)_ii. A joint that starts beyond isn't driven back; it can only move inwards. With v_tool = 0 the joints
// are held at c.
//
// - At rest a torque τ_h presses a joint by τ_h t²/(γ m_i) into its end: 14 mrad for 15 Nm on the elbow of
//   models/cells/light.yaml, within its range.
// - Inside the sets c = φ̂, and the torque is exactly 0.
// - A limit's torque acts on its own joint: M(c − φ̂) = −Σ λ_i n_i, n_i: active rows of U.
// - U is convex and contains 0, so (c − c₁)ᵀτ ≤ 0 before the mean: no torque of U drives the joints' proxy.
//
// If a drive can give only the share s of the torque, the proxy yields: c(k) = φ̂ + s (c − φ̂), outside the sets
// (set-valued form: Kikuuwe, IEEE Trans. Robotics 35:5, 2019). So nothing winds up: a hand that has overpowered a joint
// and lets go isn't pulled back.
//
// A rendered force f may release the tool only as fast as Bounds allows. The torque that prevents more is subtracted
// from f: its multiplier is at most |f|. 25 N at 750 N/m store 0.4 J, which would throw 0.5 kg at 1.3 m/s.
//
// Stability. M is the metric, so with rigid gears the loop doesn't depend on the pose. Let M_t be the true mass matrix
// (M plus the hand's mass) and M_t x = r M x in each mode x, so r ≥ 1. Then the loop is K = γ/t², B = β/t on a mass r
// (torque_rendering.hpp), delayed by the mean; with fewer active rows, K and B are smaller matrices. But above a gear's
// resonance only the rotor responds, and a torque delayed by 1.5 T drives vibrations above 120 Hz. The mean over 5 ms
// has its zero at 200 Hz and reverses the sign beyond. joint_coupling_test.cpp has the spectral radii: below 1 for
// rigid gears, r from 0.7 on and periods of 0.5 to 4 ms; and at 1 ms for the simulated gears of
// models/cells/light.yaml: 200 Hz with links of 0.034 kg m² and more, rotors of 0.06. Gears that swing between 70 and
// 180 Hz make the loop unstable.
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
  static constexpr double mean_s = 5e-3, shortest_s = 1e-3;               // of (23c), and lower bound of t

  // Bounds of one step in addition to the joints' and the cell's limits.
  struct Bounds {
    double tool_speed_m_per_s = std::numeric_limits<double>::infinity();
    // Release: n·J (c − c₁) ≤ step_m, with a force of at most force_N.
    models::Vec3 n_W = models::Vec3::Zero();
    double step_m = 0.0, force_N = 0.0;
  };

  // Precondition: `arm` outlives this object.
  JointCoupling(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                const description::CellLimits& limits, double period_s);

  // Starts the joints' proxy at rest at these angles.
  void start(const models::JointVector& link_rad) noexcept;
  // One period. Returns τ(k) without the torque of the release. Angles that aren't finite give 0 and change nothing.
  // May be called in the cycle: neither allocates, locks nor throws.
  const models::JointVector& step(const models::JointVector& link_rad, const models::Jacobian& J_W,
                                  const Bounds& bounds) noexcept;

  // The drives gave only this share of τ(k): c(k) becomes φ̂ + s (c − φ̂).
  void yield(double share) noexcept { c_k1_ = c_hat_ + share * (c_k1_ - c_hat_); }

  // The release subtracts this from the force, ≥ 0.
  [[nodiscard]] double released_N() const noexcept { return released_N_; }
  // Limits active in the last step; empty while the joints are held.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  // Number of steps in the mean of (23c).
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
  // u(k) = c − c₁ for û = φ̂ − c₁. `price`: largest multiplier of the release, in units of Mu; `paid`: the one used.
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
