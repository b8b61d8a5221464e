// Computes the joint motion per tool motion while the tool keeps its orientation: G = ∂(joint angles)/∂(tool position).
// Arms with fewer than six axes keep the orientation as well as they can (prioritized_step.hpp).
#pragma once

#include "models/arm/arm.hpp"

namespace proxarm::models {

// Weight of rotations, as a length. It equals the default of the inverse kinematics.
constexpr double turning_length_m = 0.5;

// Returns G = Jᵀ(J Jᵀ + λ²E)⁻¹ [E; 0], with one row per joint. The damping λ = 1e-3 m/rad keeps G finite: near a
// singularity a joint turns by at most 1/(2λ) = 500 rad per metre. With seven axes, G is the motion of least norm.
// Doesn't allocate.
SmallColumns3 joints_per_m(const Jacobian& J_W) noexcept;

// Returns the joint motion per turn of the tool in place: ∂(joint angles)/∂(tool rotation), per radian. Precondition:
// six axes or more.
SmallColumns3 joints_per_rad(const Jacobian& J_W) noexcept;

}  // namespace proxarm::models
