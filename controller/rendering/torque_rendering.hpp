// Impedance-type rendering by a device's own drives: position of the tool in, joint torques out.
//
//   τ = τ_g(φ) + τ_0 + s_U τ_U + s_f Jᵀ e f
// φ: link angles. τ_g: torques that hold the device against gravity. τ_0: weight missing from its model, measured at
// the start. τ_U: the device's limits (joint_coupling.hpp). J: Jacobian of T's translation. f: force of (23) on the
// hand, in W. e ≤ 1: reduces f during a release, see below. Gravity uses a drive's max_torque_Nm first, then the
// limits, then the rendered force:
//   s_U: the largest share with   |τ_g + τ_0 + s_U τ_U| ≤ τ_max             in each joint
//   s_f: the largest share with   |τ_g + τ_0 ± |s_U τ_U| + s_f Jᵀ e f| ≤ τ_max   with the sign of Jᵀf
// So a rendered force neither reduces a limit's torque nor pushes a joint through an end that its drive can just hold.
// Both keep their direction and are scaled down; τ_g + τ_0 is never reduced.
//
// A loaded coupling that is released would throw the device. In direction n = f/|f| the tool may leave the proxy of
// (23), at n·(∇p − ∇q)/T, by at most 0.07 m/s. The force for this is subtracted from f itself, so e ≥ 0: it never
// pulls.
//
// The tool is rendered as a point: joint motion that only turns it is free, apart from gravity compensation. In a scene
// of one or two dimensions, a spring of K and B holds the tool on the line or plane through the start.
//
// Delay: the torque for the position sampled at SYNC k is latched at k + 1 and acts for a period. With a wall's full K
// and B on a device of mass m at its tip, the loop is x(k) → u(k+1) = −K x(k) − B ∇x(k)/T:
//   m ẍ = u,  held over a period
// Its spectral radius (coupling_spectral_radius()) must be below 1; friction of hand and device adds margin. The gears'
// elasticity is neglected.
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
  WorldStep world;              // f_W: the objects' force; p_hat_W and q_W as in (23)
  ActiveLimits limits;          // of world and device, and joint_torque
  models::JointVector held_Nm;  // τ_U as given
};

class TorqueRendering {
 public:
  TorqueRendering() = default;
  TorqueRendering(const TorqueRendering&) = delete;
  TorqueRendering& operator=(const TorqueRendering&) = delete;
  virtual ~TorqueRendering() = default;

  // Precondition: each cycle calls either hold() or step(), with the measured φ. hold() renders nothing and holds the
  // joints at the last anchor(). Neither throws nor allocates.
  virtual void anchor(const models::JointVector& link_rad) noexcept = 0;
  virtual const TorqueStep& hold(const models::JointVector& link_rad) noexcept = 0;
  // Starts rendering here, at rest. missing_Nm: τ_0.
  virtual void start(const models::JointVector& link_rad, const models::JointVector& missing_Nm) noexcept = 0;
  // max_tool_speed_m_per_s: of the tool, if below JointCoupling's own limit; 0 holds the joints.
  virtual const TorqueStep& step(const models::JointVector& link_rad, double max_tool_speed_m_per_s) noexcept = 0;

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;
};

// Precondition: scene and arm outlive the result. Throws SetupError if the virtual coupling's values are invalid.
std::unique_ptr<TorqueRendering> make_torque_rendering(scenes::CompiledScene& scene, const models::Arm& arm,
                                                       const std::vector<description::DriveDescription>& drives,
                                                       const description::CellLimits& limits,
                                                       const ImpedanceConfig& config);

// The largest share s ≤ 1 with |base + s wanted| ≤ most in each joint, 0 if the base alone exceeds it. `cut`: bits of
// the joints that reduce it. `beside`: torque of either sign that stays free for others.
[[nodiscard]] double torque_share(const models::JointVector& wanted, const models::JointVector& base,
                                  const models::JointVector& beside, const models::JointVector& most,
                                  std::uint8_t& cut) noexcept;

// Spectral radius for a wall's K and B with a free mass; see the head of this file.
[[nodiscard]] double coupling_spectral_radius(const ImpedanceConfig& config, double mass_kg);

}  // namespace proxarm::controller
