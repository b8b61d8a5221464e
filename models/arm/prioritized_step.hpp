// A joint step with priorities: it reaches the task exactly, and among all such steps serves a secondary objective
// best.
//
//   minimise ½ δᵀH δ − gᵀδ   subject to A δ = e
// has δ = δ_e + δ_g with S = A H⁻¹ Aᵀ,
//   δ_e = H⁻¹Aᵀ S⁻¹ e               the task's step, of least cost in H
//   δ_g = (E − H⁻¹Aᵀ S⁻¹ A) H⁻¹ g   the step along g projected onto the null space of A
// (Nakamura, Advanced Robotics, 1991, ch. 4; here with one factorisation instead of nested pseudoinverses.)
//
// Arms with fewer than six axes reach only the tool's position (the rows of A) and turn the tool as little as possible:
// H = E + turning_weight J_RᵀJ_R. A radian of the tool counts ten times a radian of a joint, so the axes hold the
// orientation if they can.
#pragma once

#include "models/arm/arm.hpp"

namespace proxarm::models {

constexpr double turning_weight = 100.0;

struct PrioritizedStep {
  JointVector task;  // δ_e
  JointVector rest;  // δ_g
};

// Precondition: H is symmetric and positive definite. If A lacks full rank, results aren't finite or are far too large.
// Doesn't allocate.
PrioritizedStep prioritized_step(const JointMatrix& A, const SmallVector& e, const JointMatrix& H,
                                 const JointVector& g) noexcept;

// The H above, for the Jacobian of T.
JointMatrix turning_cost(const Jacobian& J_W, double weight = turning_weight) noexcept;

}  // namespace proxarm::models
