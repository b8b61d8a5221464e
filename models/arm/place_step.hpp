// A joint step that takes the tool to its place exactly, and turns it by what the joints have left: turning gives way
// first.
//
// Let v_i be what joint i may move in a step, D = diag(v), and b the step that follows if all joints brake together.
// The step with the place's rows J_p d = e_p and the rotation's J_R d = e_R is
//   d = b + D y,   minimise |J_R d − e_R|² + λ²|y|²  where  J_p d = e_p
// With A = J_p D and B = J_R D it has
//   y = y₀ + C (CᵀC + λ²E)⁻¹ (e_R − J_R (b + D y₀)),   y₀ = Aᵀ(AAᵀ)⁻¹(e_p − J_p b),   C = (E − Aᵀ(AAᵀ)⁻¹A) Bᵀ
// For λ → ∞ it is the change of b that is least for the place alone. λ is the least that keeps each joint within its
// bounds, so near a singularity it is in the direction that is being lost that the tool turns less. Bounds of ease
// yield to what the place needs, bounds of range and speed never.
#pragma once

#include "models/arm/arm.hpp"

namespace proxarm::models {

struct StepRoom {
  JointVector brakes_rad;                     // b
  JointVector most_rad;                       // v > 0
  JointVector low_rad, high_rad;              // of ranges and speeds
  JointVector eased_low_rad, eased_high_rad;  // of accelerations

  // Whether a step keeps all bounds.
  [[nodiscard]] bool allows(const JointVector& step_rad) const noexcept;
};

// `e` in m and rad: rows of J. False if the place alone leaves the bounds of ranges and speeds, or can't be reached;
// `step_rad` is then what it was. Preconditions: six axes or more; all is finite. Doesn't allocate.
bool place_step(const Jacobian& J_W, const Vec<6>& e, const StepRoom& room, JointVector& step_rad) noexcept;

}  // namespace proxarm::models
