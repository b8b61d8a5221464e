// A step of joints that reaches one thing exactly, and of all such steps the one that serves the rest best.
//
//   minimise ½ δᵀH δ − gᵀδ   where A δ = e
// has δ = δ_e + δ_g with S = A H⁻¹ Aᵀ,
//   δ_e = H⁻¹Aᵀ S⁻¹ e             what e takes, at the least cost in H
//   δ_g = (E − H⁻¹Aᵀ S⁻¹ A) H⁻¹ g   what g moves without touching A δ: the null space's share
// (Nakamura, Advanced Robotics, 1991, ch. 4; here by one factorization instead of nested pseudoinverses.)
//
// Arms with fewer than six axes reach the tool's place alone (A: its rows) and turn the tool as little as they can:
// H = E + turning_weight J_RᵀJ_R. A radian of the tool counts ten times a radian of a joint: where the axes can hold
// the orientation, they do.
#pragma once

#include "models/arm/arm.hpp"

namespace proxarm::models {

constexpr double turning_weight = 100.0;

struct PrioritizedStep {
  JointVector task;  // δ_e
  JointVector rest;  // δ_g
};

// Precondition: H is symmetric and positive definite. Where A has not full rank, results aren't finite, or far too
// large. Doesn't allocate.
PrioritizedStep prioritized_step(const JointMatrix& A, const SmallVector& e, const JointMatrix& H,
                                 const JointVector& g) noexcept;

// H above, for the arm's Jacobian of T.
JointMatrix turning_cost(const Jacobian& J_W, double weight = turning_weight) noexcept;

}  // namespace proxarm::models
