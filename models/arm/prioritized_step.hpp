// Computes a joint step with two priorities: the step reaches the task exactly and, among all steps that do, minimises
// a secondary cost.
//
// The problem is
//   minimise ½ δᵀH δ − gᵀδ   subject to A δ = e
// Its solution is δ = δ_e + δ_g with S = A H⁻¹ Aᵀ,
//   δ_e = H⁻¹Aᵀ S⁻¹ e               the task's step, with the least cost in H
//   δ_g = (E − H⁻¹Aᵀ S⁻¹ A) H⁻¹ g   the step along g, projected onto the null space of A
// (Nakamura, Advanced Robotics, 1991, ch. 4; here with one factorisation instead of nested pseudoinverses.)
//
// Arms with fewer than six axes reach only the tool's position (the rows of A), and turn the tool as little as
// possible: H = E + turning_weight J_RᵀJ_R. A radian of the tool counts ten times as much as a radian of a joint, so
// the axes hold the orientation if they can.
#pragma once

#include "models/arm/arm.hpp"

namespace proxarm::models {

constexpr double turning_weight = 100.0;

struct PrioritizedStep {
  JointVector task;  // δ_e
  JointVector rest;  // δ_g
};

// Returns δ_e and δ_g. Precondition: H is symmetric and positive definite. If A doesn't have full rank, the results
// aren't finite or are far too large. Doesn't allocate.
PrioritizedStep prioritized_step(const JointMatrix& A, const SmallVector& e, const JointMatrix& H,
                                 const JointVector& g) noexcept;

// Returns the H of arms with few axes, for the Jacobian of T.
JointMatrix turning_cost(const Jacobian& J_W, double weight = turning_weight) noexcept;

}  // namespace proxarm::models
