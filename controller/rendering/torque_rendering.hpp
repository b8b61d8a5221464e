// Impedance-type rendering of a scene by the device's own drives: the tool's position goes in, joint torques come out.
//
//   τ = τ_g(φ) + s Jᵀ f
// φ: the links' angles; τ_g: torques that hold the device against gravity; J: the Jacobian of T's translation; f: the
// force of (23) on the hand, in W. s ≤ 1 is the largest share with which no joint exceeds its max_torque_Nm. A rendered
// force that is too large for the joints keeps its direction and is scaled down; τ_g is never reduced.
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
  WorldStep world;      // f_W: the objects' force; p_hat_W and q_W as in (23)
  ActiveLimits limits;  // those of the world, and joint_torque
};

class TorqueRendering {
 public:
  TorqueRendering() = default;
  TorqueRendering(const TorqueRendering&) = delete;
  TorqueRendering& operator=(const TorqueRendering&) = delete;
  virtual ~TorqueRendering() = default;

  // Precondition: in each cycle, either hold() or step() is called with φ as measured. hold() renders nothing: a spring
  // of K and B holds the tool where it was at the last anchor(). Neither throws nor allocates.
  virtual void anchor(const models::JointVector& link_rad) noexcept = 0;
  virtual const TorqueStep& hold(const models::JointVector& link_rad) noexcept = 0;
  // Starts rendering here, at rest.
  virtual void start(const models::JointVector& link_rad) noexcept = 0;
  virtual const TorqueStep& step(const models::JointVector& link_rad) noexcept = 0;

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;
};

// Precondition: scene and arm outlive the result. Throws SetupError for a virtual coupling with invalid figures.
std::unique_ptr<TorqueRendering> make_torque_rendering(scenes::CompiledScene& scene, const models::Arm& arm,
                                                       const std::vector<description::DriveDescription>& drives,
                                                       const description::CellLimits& limits,
                                                       const ImpedanceConfig& config);

// The spectral radius of a wall's K and B with a free mass, see the head of this file.
[[nodiscard]] double coupling_spectral_radius(const ImpedanceConfig& config, double mass_kg);

}  // namespace proxarm::controller
