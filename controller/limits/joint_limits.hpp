// The limits of the joints in a step: half-spaces around its beginning (step_limits.hpp), which are made only where a
// step may reach one of them.
//
// A step x of the tool moves joint i by g_i·x, with g_i the i-th row of G = ∂(joint angles)/∂(tool position)
// (held_orientation.hpp). If b_i is what joint i may still move, all half-spaces g_i·x ≤ b_i contain the ball
//   ‖x‖ ≤ min_i b_i/‖g_i‖
// G is the dearest part of all limits, and most steps are far within that ball. So ‖g_i‖ is bounded by what it was at
// angles q₀ where G was last computed. With e a bound of ‖J − J₀‖ and σ₀ one of the smallest singular value of J₀, from
// below:
//   ‖J − J₀‖ ≤ e = Σ_k w_k |q_k − q₀_k|,   w_k² = Σ_j (C_kj² + l²) ≥ ‖∂J/∂q_k‖²      C: Arm::path_curvature()
//   ‖g_i‖ ≤ ‖g_i(q₀)‖ + 2e/(σ₀(σ₀ − e))   for e < σ₀
// For G = [E 0] F, F = B⁻¹J with B = J Jᵀ + λ²E, has dFᵀ = (E − JᵀB⁻¹J) dJᵀB⁻¹ − Fᵀ dJ Fᵀ, in which the first factor is
// at most 1, ‖B⁻¹‖ and ‖F‖² are at most 1/σ², and σ ≥ σ₀ − e. The bound holds where all joints turn and there are six
// or more of them; in other arms the half-spaces are made in each step.
//
// Leaving them out changes no step by a bit: whoever asks for the nearest point of all sets makes them first. Neither
// allocates, locks nor throws.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class JointLimits {
 public:
  JointLimits(const models::Arm& arm, const std::vector<description::DriveDescription>& drives, double period_s);

  void set_period(double period_s) noexcept;
  // Begins a step. `joint_rad`: angles of the links; `twist_rad`: by how much each motor is ahead of its link; `J_W`:
  // of T at joint_rad. Precondition: J_W lives until the next step begins.
  void begin(const models::JointVector& joint_rad, const models::JointVector& twist_rad,
             const models::Jacobian& J_W) noexcept;
  // Whether none of them reaches into the ball ‖x‖ ≤ step_m. With `way_m`, nor would if the tool had gone that far
  // before, which brings the end of a joint's range nearer.
  [[nodiscard]] bool out_of_reach(double step_m, double way_m = 0.0) const noexcept {
    return step_m <= clear_m_ - share_ * way_m;
  }
  // By how much joint i may turn towards the end of its range (sign 1: the upper one), so that it can brake before it.
  [[nodiscard]] double room_rad(std::size_t i, double sign) const noexcept;
  // The half-spaces; made when they are first asked for in a step.
  [[nodiscard]] std::span<const LimitPlane<3>> planes() noexcept;

  struct Counts {
    std::uint64_t made = 0;    // steps in which the half-spaces were made
    std::uint64_t bounds = 0;  // times that the bound of G was computed anew
  };
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  struct Joint {
    double lower_rad, upper_rad, speed_rad_per_s, acceleration_rad_per_s2;
    double per_step_rad, share;  // of the period: what it may turn, and what share of the way to its range's end
  };
  [[nodiscard]] double bent() const noexcept;
  [[nodiscard]] double clear_m() const noexcept;
  void bound_from_here(const models::SmallColumns3& G) noexcept;

  std::vector<Joint> joints_;
  models::JointVector weights_;  // w
  bool bounded_;                 // the bound above holds for this arm
  double share_ = 0.0;           // the largest of the joints' shares

  // Of this step:
  models::JointVector joint_rad_, twist_rad_;
  const models::Jacobian* J_W_ = nullptr;
  double clear_m_ = 0.0;
  bool made_ = false;
  std::array<LimitPlane<3>, 2 * models::max_axes> planes_{};
  std::size_t count_ = 0;

  // At q₀. What it is changes what is computed, not what comes of it, so it isn't archived.
  models::JointVector from_rad_, rows_;  // q₀ and ‖g_i‖
  double least_ = 0.0;                   // σ₀; 0: none yet, or too near to a singularity
  Counts counts_;
};

}  // namespace proxarm::controller
