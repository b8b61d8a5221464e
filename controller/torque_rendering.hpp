// Impedance-type rendering of a scene by the device's own drives: where the tool is goes in, joint torques come out.
//
//   τ = τ_g(φ) + s Jᵀ f
// φ: the links' angles; τ_g: what holds the device up against gravity; J: translations of T; f: the force of (23) on
// the hand, W. s ≤ 1 is the largest share with which no joint is asked for more than its max_torque_Nm: a rendered
// force that is too large is weaker, not elsewhere, and what holds the device up is never cut.
//
// The tool is a point: what turns it, and what moves no point of it, is carried against gravity and otherwise free. Off
// the space of a scene of one or two dimensions a spring of K and B holds the tool on the start.
//
// Delay: the torque for the position sampled at SYNC k is latched at k + 1 and acts for a period. With a wall's whole
// K and B on a device of mass m at its tip, the loop is x(k) → u(k+1) = −K x(k) − B ∇x(k)/T:
//   m ẍ = u,  held over a period
// and the largest eigenvalue of that (coupling_spectral_radius) must be below 1; friction of hand and device come on
// top. Takes no account of the gears' elasticity.
#pragma once

#include <memory>
#include <vector>

#include "controller/impedance_proxy.hpp"
#include "controller/rendered_world.hpp"
#include "controller/step_limits.hpp"
#include "models/arm.hpp"
#include "scenes/compile.hpp"

namespace proxarm::controller {

struct TorqueStep {
  models::JointVector torque_Nm;
  WorldStep world;      // f_W: the objects' force; p_hat_W and q_W as in (23)
  ActiveLimits limits;  // the world's, and joint_torque
};

class TorqueRendering {
 public:
  TorqueRendering() = default;
  TorqueRendering(const TorqueRendering&) = delete;
  TorqueRendering& operator=(const TorqueRendering&) = delete;
  virtual ~TorqueRendering() = default;

  // Each cycle one of these two, φ as measured. hold(): nothing is rendered; a spring of K and B holds the tool where
  // it was at the last anchor(). noexcept, no allocation.
  virtual void anchor(const models::JointVector& link_rad) noexcept = 0;
  virtual const TorqueStep& hold(const models::JointVector& link_rad) noexcept = 0;
  // From here on, at rest.
  virtual void start(const models::JointVector& link_rad) noexcept = 0;
  virtual const TorqueStep& step(const models::JointVector& link_rad) noexcept = 0;

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;
};

// Scene and arm must outlive the result. Throws SetupError where the coupling's figures can't be.
std::unique_ptr<TorqueRendering> make_torque_rendering(scenes::CompiledScene& scene, const models::Arm& arm,
                                                       const std::vector<description::DriveDescription>& drives,
                                                       const description::CellLimits& limits,
                                                       const ImpedanceConfig& config);

// Of a wall's K and B on a free mass, see above.
[[nodiscard]] double coupling_spectral_radius(const ImpedanceConfig& config, double mass_kg);

}  // namespace proxarm::controller
