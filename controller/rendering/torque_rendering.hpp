// Impedance-type rendering of a scene by the device's own drives: the tool's position goes in, joint torques come out.
//
//   τ = τ_g(φ) + τ_0 + s_U τ_U + s_f Jᵀ e f
// φ: the links' angles. τ_g: torques that hold the device against gravity. τ_0: what the model of its weight lacked at
// the start. τ_U: the device's own limits (joint_coupling.hpp). J: the Jacobian of T's translation. f: the force of
// (23) on the hand, in W. e ≤ 1: what a coupling that is let go gives back, below. A drive's max_torque_Nm is shared
// out in this order: gravity first, then the limits, and to what is rendered what the limits leave:
//   s_U: the largest share with   |τ_g + τ_0 + s_U τ_U| ≤ τ_max             in each joint
//   s_f: the largest share with   |τ_g + τ_0 ± |s_U τ_U| + s_f Jᵀ e f| ≤ τ_max   with the sign of Jᵀf
// So a rendered force neither takes a wall's torque away nor, at an end that the drive can just hold, pushes through
// it: each keeps its direction, is scaled down, and τ_g + τ_0 is never reduced.
//
// A coupling that is let go under load would throw the device. In direction n = f/|f| the tool may leave the proxy of
// (23), that is n·(∇p − ∇q)/T, by 0.07 m/s; what keeps it to that is taken from the force itself, so e ≥ 0: it can't
// suck.
//
// The tool is rendered as a point: joint motion that only turns it is free, apart from the compensation of gravity. In
// a scene of one or two dimensions, a spring of K and B holds the tool on the line or plane through the start.
//
// Delay: the torque for the position sampled at SYNC k is latched at k + 1 and acts for a period. With a wall's whole
// K and B on a device of mass m at its tip, the loop is x(k) → u(k+1) = −K x(k) − B ∇x(k)/T:
//   m ẍ = u,  held over a period
// and its spectral radius (coupling_spectral_radius()) must be below 1; friction of hand and device adds to the margin.
// The gears' elasticity isn't taken into account.
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
  ActiveLimits limits;          // those of the world and of the device, and joint_torque
  models::JointVector held_Nm;  // τ_U as it is given
};

class TorqueRendering {
 public:
  TorqueRendering() = default;
  TorqueRendering(const TorqueRendering&) = delete;
  TorqueRendering& operator=(const TorqueRendering&) = delete;
  virtual ~TorqueRendering() = default;

  // Precondition: in each cycle, either hold() or step() is called with φ as measured. hold() renders nothing: the
  // joints are held where they were at the last anchor(). Neither throws nor allocates.
  virtual void anchor(const models::JointVector& link_rad) noexcept = 0;
  virtual const TorqueStep& hold(const models::JointVector& link_rad) noexcept = 0;
  // Starts rendering here, at rest. `missing_Nm`: τ_0.
  virtual void start(const models::JointVector& link_rad, const models::JointVector& missing_Nm) noexcept = 0;
  // `max_tool_speed_m_per_s`: of the tool, if lower than what JointCoupling keeps to by itself; 0 holds the joints.
  virtual const TorqueStep& step(const models::JointVector& link_rad, double max_tool_speed_m_per_s) noexcept = 0;

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;
};

// Precondition: scene and arm outlive the result. Throws SetupError for a virtual coupling with invalid figures.
std::unique_ptr<TorqueRendering> make_torque_rendering(scenes::CompiledScene& scene, const models::Arm& arm,
                                                       const std::vector<description::DriveDescription>& drives,
                                                       const description::CellLimits& limits,
                                                       const ImpedanceConfig& config);

// The largest share s ≤ 1 of `wanted` with |base + s wanted| ≤ most in each joint. Bits of `cut`: joints that took
// some. 0 where the base alone exceeds it. `beside`: torque that is kept free for others, whatever its sign.
[[nodiscard]] double torque_share(const models::JointVector& wanted, const models::JointVector& base,
                                  const models::JointVector& beside, const models::JointVector& most,
                                  std::uint8_t& cut) noexcept;

// The spectral radius of a wall's K and B with a free mass, see the head of this file.
[[nodiscard]] double coupling_spectral_radius(const ImpedanceConfig& config, double mass_kg);

}  // namespace proxarm::controller
