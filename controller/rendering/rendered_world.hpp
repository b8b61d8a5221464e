// The proxy and its scene as the cycle sees them: force in W in, the tool's next position in W out.
//
// The scene has n = 1, 2 or 3 dimensions. Its space is o + U x; x: n coordinates, U: orthonormal 3×n basis. The
// component of the start position outside that space is kept, so nothing jumps, and the proxy moves along the line or
// plane through the start.
//
//   x = Uᵀ(q_W − o),   h = Uᵀ h_W,   q_W = q_start + U (x − x_start)
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "controller/limits/step_limits.hpp"
#include "controller/proxies/admittance_proxy.hpp"
#include "controller/rendering/change.hpp"
#include "controller/rendering/session_settings.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

// Contacts per step that are reported one by one.
using Touches = std::array<models::PoseContact, 8>;

// Result of a step of the proxy; all in W.
struct WorldStep {
  models::Vec3 q_W = models::Vec3::Zero();       // the new proxy
  models::Vec3 p_hat_W = models::Vec3::Zero();   // p̂: the proxy's position without a world
  models::Vec3 f_W = models::Vec3::Zero();       // the world's force on the proxy, (25a)
  models::Vec3 torque_W = models::Vec3::Zero();  // about q; rigid tools only
  models::Vec3 v_W = models::Vec3::Zero();
  int contacts = 0;  // number of pressing contacts
  // Reported contacts; without place and force for a point. Owned by the world, valid until its next step.
  std::span<const models::PoseContact> touches;
  bool slips = false;
  bool unresolved = false;                             // 𝒢 found no solution that keeps all laws of contact
  ActiveLimits limits;                                 // limits that held the proxy back
  bool soft_limits_met = true;                         // leash and power are satisfied
  models::Vec3 limit_force_W = models::Vec3::Zero();   // the limits' force on the proxy; not in f_W
  models::Vec3 limit_torque_W = models::Vec3::Zero();  // the same for torque; rigid tools only
  double mass_kg = 0.0, damping_Ns_per_m = 0.0;        // M and B of this step
  bool settled = false;                                // the start was moved to an allowed place, where the proxy rests
  ProxyFault fault = ProxyFault::none;
};

// Adds the contacts of a step to `touches`, normals turned to W by the scene's basis. Precondition: `step` has no
// contacts yet; `touches` outlives it.
template <int N>
void add_contacts(WorldStep& step, Touches& touches, std::span<const models::Contact<N>> contacts,
                  const Eigen::Matrix<double, 3, N>& basis) noexcept {
  for (const models::Contact<N>& contact : contacts) {
    const auto place = static_cast<std::size_t>(step.contacts++);
    if (place < touches.size()) {
      models::PoseContact& touch = touches[place];
      touch.object = contact.object;
      touch.part = -1;
      touch.slips = contact.slips;
      touch.normal_W = basis * contact.normal;
    }
    step.slips = step.slips || contact.slips;
  }
  step.touches = {touches.data(), std::min(contacts.size(), touches.size())};
}

class RenderedWorld {
 public:
  RenderedWorld() = default;
  RenderedWorld(const RenderedWorld&) = delete;
  RenderedWorld& operator=(const RenderedWorld&) = delete;
  virtual ~RenderedWorld() = default;

  // Starts the proxy at rest at q_W, with a spring's anchor there. If an object or guide excludes that place, the first
  // steps move the proxy to an allowed place, at rest, and ignore the force.
  virtual void start(const models::Vec3& q_W) noexcept = 0;
  // One period under the hand's force, within these limits. The result's q_W is always finite; after a fault it is the
  // previous one.
  virtual WorldStep step(const models::Vec3& h_W, const StepLimits& limits) noexcept = 0;
  // The proxy's place horizon_s after its last step, if h_W acts on it (lookahead.hpp); with h_W = 0 it coasts.
  // Precondition: that step was made within the same limits. A world without lookahead returns the proxy's place.
  virtual models::Vec3 look_ahead(const models::Vec3& h_W, const StepLimits& limits, double horizon_s) noexcept = 0;
  // The arm couldn't follow: the proxy continues with this velocity, from the place nearest to q_W that the scene's
  // objects let it reach. Returns that place.
  virtual models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W) noexcept = 0;
  // Acts from the next step on. Position and velocity don't jump. A value out of range changes nothing.
  virtual void set(const Change& change) noexcept = 0;
  // Sets the period of the following steps. Precondition: the proxy is at rest. Moving objects don't jump, but their
  // last step had the old period.
  virtual void set_period(double period_s) noexcept = 0;
  // Damping in addition to the user's from the next step on (passivity.hpp).
  virtual void add_damping(double damping_Ns_per_m) noexcept = 0;
  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;
};

// proxy_mass_kg: the wanted mass less the tool's behind the sensor. Precondition: the scene outlives the result.
std::unique_ptr<RenderedWorld> make_rendered_world(scenes::CompiledScene& scene, const SessionSettings& settings,
                                                   double proxy_mass_kg);

}  // namespace proxarm::controller
