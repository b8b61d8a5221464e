// The curvature of gaps, and what it adds to the stiffness of the local problem.
//
// The balance K (q ⊟ p̂) = Σ J_iᵀ f_i is linearised in q with its normals, which turn with the pose: each contact that
// presses with f_n adds −f_n ∇²gap to K. From inside of something hollow gaps are concave, so that this is positive
// semidefinite. With K̃ = K − Σ f_n ∇²gap and ẽ = K̃⁻¹ K e the local problem keeps its form,
//
//   K̃ (ẽ + δ) = Σ J_iᵀ f_i,
//
// at δ = 0 it is the balance itself, and the outer iteration becomes Newton's (sequential quadratic programming).
//
//   a point in a tube or a sphere   gap = R − ‖P x‖, P across the axis or I:  −∇²gap = Gᵀ(P − m mᵀ)G / ‖P x‖, with
//                                   m = P x/‖P x‖ and G the point's motion in the twist
//   a rim                           its place x(α) is the highest of h = ‖P x(α)‖ (of −nᵀx(α) over a plane):
//                                   h_qq − h_qα h_αα⁻¹ h_αq. If it conforms, h_αα is nearly 0: minus the clearance of a
//                                   peg in its tube, −r sin(tilt) over a plane
//   two sides                       near_sides.hpp
//
// The terms of the order of the lever over K that come from rotations not being vectors are left out; they slow the
// iteration by a millionth and don't move its end.
#pragma once

#include "models/geometry/small_matrix.hpp"
#include "models/rigid_bodies/rigid_bodies.hpp"
#include "models/rigid_gaps/touches.hpp"

namespace proxarm::models {

// Adds −force ∇²gap of a touch (force: normal, N) to K. False: its gap has no curvature.
bool add_bend(const RigidBodies& bodies, const Pair& pair, const Found& found, const ToolPose& pose, double force,
              Mat6& K) noexcept;
// Sum of the curvatures of the two bodies where they are round, 1/m.
[[nodiscard]] double curvature_per_m(const RigidBodies& bodies, const Pair& pair) noexcept;
// Sine of the angle γ at which a rim crosses a rim or an edge; 1 for other pairs. If a point of one moves across the
// other by s, the place of contact moves along by up to s/sin γ, on circles: their gap bends by up to
// (1/r + 1/r')/sin² γ. Their normal is across both, and turns by up to θ/sin γ if one of them turns by θ.
[[nodiscard]] double sine_of_rims(const RigidBodies& bodies, const Pair& pair, const Touch& touch,
                                  const ToolPose& pose) noexcept;

}  // namespace proxarm::models
