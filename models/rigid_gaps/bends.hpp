// Computes the curvature of gaps and adds it to the stiffness of the local problem.
//
// The balance K (q ⊟ p̂) = Σ J_iᵀ f_i is linearised in q. The normals turn with the pose, so each contact that presses
// with f_n adds −f_n ∇²gap to K. Inside a hollow object the gaps are concave, so this term is positive semidefinite.
// With K̃ = K − Σ f_n ∇²gap and ẽ = K̃⁻¹ K e the local problem keeps its form,
//
//   K̃ (ẽ + δ) = Σ J_iᵀ f_i,
//
// At δ = 0 this equation is the balance itself, and the outer iteration is Newton's method (sequential quadratic
// programming).
//
//   a point in a tube or a sphere   gap = R − ‖P x‖, P across the axis or I:  −∇²gap = Gᵀ(P − m mᵀ)G / ‖P x‖, with
//                                   m = P x/‖P x‖ and G the point's motion in the twist
//   a rim                           the place x(α) on the rim is the maximum of h = ‖P x(α)‖ (over a plane: of
//                                   h = −nᵀx(α)), and −∇²gap = h_qq − h_qα h_αα⁻¹ h_αq. If the rim fits the surface
//                                   closely, h_αα is nearly 0: minus the clearance for a peg in a tube, −r sin(tilt)
//                                   over a plane
//   two sides                       near_sides.hpp
//
// Rotations aren't vectors, which would add terms of the order of the lever over K. These terms are left out: they slow
// the iteration by a millionth and don't change its fixed point.
#pragma once

#include "models/geometry/small_matrix.hpp"
#include "models/rigid_bodies/rigid_bodies.hpp"
#include "models/rigid_gaps/touches.hpp"

namespace proxarm::models {

// Adds −force ∇²gap of a touch to K; `force` is the normal force, N. Returns false if the gap has no curvature.
bool add_bend(const RigidBodies& bodies, const Pair& pair, const Found& found, const ToolPose& pose, double force,
              Mat6& K) noexcept;
// Returns the sum of the curvatures of the pair's two bodies, 1/m; flat bodies add 0.
[[nodiscard]] double curvature_per_m(const RigidBodies& bodies, const Pair& pair) noexcept;
// Returns the sine of the angle γ at which a rim crosses a rim or an edge; 1 for other pairs. It has two effects:
// 1. If a point of the first curve moves across the second curve by s, the place of contact moves along the curves by
//    up to s/sin γ. On circles of the radii r and r' the gap's curvature is then up to (1/r + 1/r')/sin² γ.
// 2. The normal is perpendicular to both curves. If one of the curves turns by θ, the normal turns by up to θ/sin γ.
[[nodiscard]] double sine_of_rims(const RigidBodies& bodies, const Pair& pair, const Touch& touch,
                                  const ToolPose& pose) noexcept;

}  // namespace proxarm::models
