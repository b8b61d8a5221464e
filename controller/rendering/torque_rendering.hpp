// Computes joint torques from the position of the tool: impedance-type rendering by the drives of a device.
//
//   τ = τ_g(φ) + τ_0 + s_U τ_U + s_f Jᵀ e f
// φ: link angles.
// τ_g: torques that hold the device against gravity.
// τ_0: torques of the weight that the device's model lacks, measured at the start.
// τ_U: torques of the device's limits (joint_coupling.hpp).
// J: Jacobian of T's translation.
// f: force of (23) on the hand, in W.
// e ≤ 1: reduces f during a release.
// Gravity uses a drive's max_torque_Nm first, then the limits, then the rendered force:
//   s_U: the largest share with   |τ_g + τ_0 + s_U τ_U| ≤ τ_max             in each joint
//   s_f: the largest share with   |τ_g + τ_0 ± |s_U τ_U| + s_f Jᵀ e f| ≤ τ_max   with the sign of Jᵀf
// So a rendered force doesn't reduce a limit's torque, and doesn't push a joint through an end that its drive can just
// hold. The limits' torques and the rendered force are scaled down without changing their direction. τ_g + τ_0 is never
// reduced.
//
// A loaded coupling that is released would throw the device. So the tool may leave the proxy of (23) in the direction
// n = f/|f| by at most 0.07 m/s: n·(∇p − ∇q)/T ≤ 0.07 m/s. The force that keeps this bound is subtracted from f and is
// at most |f|. So e ≥ 0, and the coupling never pulls the hand.
//
// The tool is rendered as a point: joint motion that only turns the tool is free, apart from gravity compensation. In a
// scene of one or two dimensions, a spring of K and B holds the tool on the line or plane through the start position.
//
// Delay: the torque for the position sampled at SYNC k is latched at SYNC k + 1 and acts for a period. With a wall's
// full K and B on a device of mass m at its tip, the loop is
//   u(k+1) = −K x(k) − B ∇x(k)/T,   m ẍ = u, where u is constant over a period
// The loop's spectral radius (coupling_spectral_radius()) must be below 1; friction of hand and device adds margin. The
// gears' elasticity is neglected.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "controller/proxies/impedance_proxy.hpp"
#include "controller/rendering/rendered_world.hpp"
#include "models/arm/arm.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

struct TorqueStep {
  models::JointVector torque_Nm;
  WorldStep world;              // f_W: the objects' force; p_hat_W and q_W: p̂ and q of (23)
  ActiveLimits limits;          // active limits of world and device, and joint_torque
  models::JointVector held_Nm;  // s_U τ_U, the limits' torques that the drives give
};

class TorqueRendering {
 public:
  TorqueRendering() = default;
  TorqueRendering(const TorqueRendering&) = delete;
  TorqueRendering& operator=(const TorqueRendering&) = delete;
  virtual ~TorqueRendering() = default;

  // Call either hold() or step() in each cycle, with the measured φ. No function throws or allocates.
  //
  // Sets the angles at which hold() holds the joints.
  virtual void anchor(const models::JointVector& link_rad) noexcept = 0;
  // Holds the joints at the angles of the last anchor(), without rendering.
  virtual const TorqueStep& hold(const models::JointVector& link_rad) noexcept = 0;
  // Starts rendering at link_rad, at rest. missing_Nm: τ_0.
  virtual void start(const models::JointVector& link_rad, const models::JointVector& missing_Nm) noexcept = 0;
  // Renders one period. max_tool_speed_m_per_s: speed limit of the tool; acts if it is below JointCoupling's limit; 0
  // holds the joints.
  virtual const TorqueStep& step(const models::JointVector& link_rad, double max_tool_speed_m_per_s) noexcept = 0;

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;
};

// Precondition: scene and arm outlive the result. Throws SetupError if the virtual coupling's values are invalid.
std::unique_ptr<TorqueRendering> make_torque_rendering(scenes::CompiledScene& scene, const models::Arm& arm,
                                                       const std::vector<description::DriveDescription>& drives,
                                                       const description::CellLimits& limits,
                                                       const ImpedanceConfig& config);

// Returns the largest share s ≤ 1 with |base + s wanted| ≤ most − |beside| in each joint; 0 if `base` alone exceeds
// this bound. `beside`: torque that is reserved in both directions. Adds the bits of the joints that reduce s to `cut`.
[[nodiscard]] double torque_share(const models::JointVector& wanted, const models::JointVector& base,
                                  const models::JointVector& beside, const models::JointVector& most,
                                  std::uint8_t& cut) noexcept;

// Returns the spectral radius of the loop with a wall's K and B on a free mass (opening comment of this file).
[[nodiscard]] double coupling_spectral_radius(const ImpedanceConfig& config, double mass_kg);

}  // namespace proxarm::controller
