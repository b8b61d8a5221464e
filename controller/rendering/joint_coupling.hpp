// Keeps the limits of a device that takes torques, as sets of joint steps: (23) of Kikuuwe and Fujimoto (World Haptics
// 2007) in joint space. One law keeps joint ranges, joint speeds and the tool's speed, brakes a device with an empty
// handle, and bounds the release of a coupling.
//
// φ(k): measured link angles. c(k): the joints' proxy, which keeps the sets. φ₁ = φ(k−1), c₁ = c(k−1). M(φ): mass
// matrix with rotors. J: Jacobian of T's translation. t: T or 1 ms, whichever is longer. The force of (23) becomes a
// torque, and its 𝒢 is (2):
//   φ̂(k) = φ + B(c₁ − φ₁)/(KT + B)                                      (23a)
//   c(k) = argmin ½(c − φ̂)ᵀ M (c − φ̂)   where   c − c₁ ∈ U               (23b), (2)
//   τ(k) = mean over 5 ms of (K + B/T)(c − φ̂),   K = γ M/t², B = β M/t    (23c)
// The sets of U use a share of each limit, since a hand moves the arm beyond the proxy before the torque has risen:
//   −T min(v, C(c₁ − c_min)) ≤ c − c₁ ≤ T min(v, C(c_max − c₁))   v = 3/4 max_speed_rad_per_s
//   |J (c − c₁)| ≤ T v_tool                                       v_tool = 2/5 max_tool_speed_m_per_s, or less
// C(d): the speed from which braking with a fifth of max_acceleration_rad_per_s2 ends within d (limits/braking.hpp).
// c_min, c_max: the ends of range_rad, moved inwards by the distance by which the drive's full torque presses a joint
// into its end, τ_max t²/(γ m_i) with m_i = 1/(M⁻¹)_ii. A joint that starts beyond c_min or c_max isn't driven back,
// but can only move inwards. With v_tool = 0 the joints are held at c.
//
// - At rest a torque τ_h presses a joint by τ_h t²/(γ m_i) into its end: 14 mrad for 15 Nm on the elbow of
//   models/cells/light.yaml, which is within the elbow's range.
// - Inside the sets c = φ̂, and the torque is exactly 0.
// - A joint's limit makes a torque on this joint only: M(c − φ̂) = −Σ λ_i n_i, n_i: active rows of U.
// - U is convex and contains 0, so (c − c₁)ᵀτ ≤ 0 before the mean: no torque of U drives the joints' proxy.
//
// If a drive can give only the share s of the torque, the proxy yields: c(k) = φ̂ + s (c − φ̂), which is outside the
// sets (set-valued form: Kikuuwe, IEEE Trans. Robotics 35:5, 2019). So nothing winds up: when a hand that has
// overpowered a joint lets go, the joint isn't pulled back.
//
// A rendered force f may release the tool only as fast as Bounds allows. The force that prevents a faster release is
// subtracted from f; this force is the multiplier of the release's row, and at most |f|. Without this bound, 25 N at
// 750 N/m would store 0.4 J and throw 0.5 kg at 1.3 m/s.
//
// Stability:
//   1. M is the metric, so with rigid gears the loop doesn't depend on the pose. Let M_t be the true mass matrix (M
//      plus the hand's mass), and M_t x = r M x for each mode x, so r ≥ 1. The loop of a mode is K = γ/t², B = β/t on a
//      mass r (torque_rendering.hpp), delayed by the mean. With fewer active rows, K and B are smaller matrices.
//   2. Above a gear's resonance only the rotor responds. A torque that is delayed by 1.5 T would drive vibrations above
//      120 Hz. The mean over 5 ms is zero at 200 Hz, and has the opposite sign above 200 Hz.
//   3. joint_coupling_test.cpp computes the spectral radii. They are below 1 with rigid gears, for r ≥ 0.7 and periods
//      of 0.5 to 4 ms. At 1 ms they are also below 1 with the simulated gears of models/cells/light.yaml: 200 Hz, links
//      of 0.034 kg m² and more, rotors of 0.06 kg m². Gears whose resonance is between 70 and 180 Hz make the loop
//      unstable.
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
  // mean_s: duration of the mean in (23c). shortest_s: lower bound of t.
  static constexpr double mean_s = 5e-3, shortest_s = 1e-3;

  // Bounds of one step, besides the limits of joints and cell.
  struct Bounds {
    double tool_speed_m_per_s = std::numeric_limits<double>::infinity();
    // Bound of a release: n·J (c − c₁) ≤ step_m. The force that keeps this bound is at most force_N.
    models::Vec3 n_W = models::Vec3::Zero();
    double step_m = 0.0, force_N = 0.0;
  };

  // Precondition: `arm` outlives this object.
  JointCoupling(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                const description::CellLimits& limits, double period_s);

  // Starts the joints' proxy at rest at these angles.
  void start(const models::JointVector& link_rad) noexcept;
  // Computes one period. Returns τ(k) without the torque of the release. Angles that aren't finite give zero for this
  // period's part of the mean, and don't move the proxy. May be called in the cycle: doesn't allocate, lock or throw.
  const models::JointVector& step(const models::JointVector& link_rad, const models::Jacobian& J_W,
                                  const Bounds& bounds) noexcept;

  // Call if the drives can give only the share s of τ(k): c(k) becomes φ̂ + s (c − φ̂).
  void yield(double share) noexcept { c_k1_ = c_hat_ + share * (c_k1_ - c_hat_); }

  // The size of the force that the bound of the release subtracts from the rendered force; ≥ 0.
  [[nodiscard]] double released_N() const noexcept { return released_N_; }
  // The limits that were active in the last step; empty while the joints are held.
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
    models::JointVector lower, upper;  // bounds of c − c₁
  };
  struct Given {
    models::JointVector torque_Nm;
    double released_N = 0.0;
  };

  [[nodiscard]] Box box(const models::JointMatrix& M) const noexcept;
  // Returns u(k) = c − c₁ for û = φ̂ − c₁. `price`: largest multiplier of the release's row, in units of Mu. `paid`:
  // the multiplier of the result.
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
