// Computes the tool's next position in a scene from the hand's force, both in W.
//
// The scene has n = 1, 2 or 3 dimensions. Its space is o + U x, where x are n coordinates and U is an orthonormal 3×n
// basis. The component of the start position outside the scene's space is kept. So nothing jumps, and the proxy moves
// along the line or plane through the start position.
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

// The contacts of a step that are reported one by one.
using Touches = std::array<models::PoseContact, 8>;

// Result of a step of the proxy. All vectors are in W.
struct WorldStep {
  models::Vec3 q_W = models::Vec3::Zero();       // the proxy's new position
  models::Vec3 p_hat_W = models::Vec3::Zero();   // p̂: the proxy's position without a world
  models::Vec3 f_W = models::Vec3::Zero();       // the world's force on the proxy, (25a)
  models::Vec3 torque_W = models::Vec3::Zero();  // the world's torque about q; rigid tools only
  models::Vec3 v_W = models::Vec3::Zero();
  int contacts = 0;  // number of pressing contacts
  // The reported contacts. A point tool's contacts have no place and no force. The world owns them; they are valid
  // until its next step.
  std::span<const models::PoseContact> touches;
  bool slips = false;
  bool unresolved = false;                             // 𝒢 found no solution that keeps all laws of contact
  ActiveLimits limits;                                 // limits that held the proxy back
  bool soft_limits_met = true;                         // the step keeps leash and power
  models::Vec3 limit_force_W = models::Vec3::Zero();   // the limits' force on the proxy; not part of f_W
  models::Vec3 limit_torque_W = models::Vec3::Zero();  // the limits' torque on the proxy; not part of torque_W
  double mass_kg = 0.0, damping_Ns_per_m = 0.0;        // M and B of this step
  bool settled = false;                                // the step moved the start to an allowed place, at rest
  ProxyFault fault = ProxyFault::none;
};

// Adds the contacts of a step to `touches` and to `step`, with normals in W by the scene's basis. Preconditions: `step`
// has no contacts yet, and `touches` outlives `step`.
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

  // Starts the proxy at rest at q_W, which becomes the place of a spring's anchor. If an object or guide excludes q_W,
  // the first steps ignore the hand's force and move the proxy to an allowed place, at rest.
  virtual void start(const models::Vec3& q_W) noexcept = 0;
  // Moves the proxy for one period under the hand's force, within these limits. The result's q_W is always finite;
  // after a fault it is the previous q_W.
  virtual WorldStep step(const models::Vec3& h_W, const StepLimits& limits) noexcept = 0;
  // Returns the proxy's place horizon_s after its last step, if h_W acts on the proxy (lookahead.hpp); with h_W = 0 the
  // proxy coasts. Precondition: `limits` are the limits of the last step. A world without lookahead returns the proxy's
  // place after the last step.
  virtual models::Vec3 look_ahead(const models::Vec3& h_W, const StepLimits& limits, double horizon_s) noexcept = 0;
  // Call if the arm couldn't follow: the proxy continues with this velocity, from the place nearest to q_W that the
  // scene's objects let it reach. Returns this place.
  virtual models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W) noexcept = 0;
  // Changes a parameter from the next step on. Position and velocity don't jump. A value out of range changes nothing.
  virtual void set(const Change& change) noexcept = 0;
  // Sets the period of the following steps. Precondition: the proxy is at rest. Moving objects don't jump, but their
  // last step had the old period.
  virtual void set_period(double period_s) noexcept = 0;
  // Sets the damping that is added to the user's damping from the next step on (passivity.hpp).
  virtual void add_damping(double damping_Ns_per_m) noexcept = 0;
  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;
};

// proxy_mass_kg: the felt mass less the mass of the tool behind the sensor. Precondition: the scene outlives the
// result.
std::unique_ptr<RenderedWorld> make_rendered_world(scenes::CompiledScene& scene, const SessionSettings& settings,
                                                   double proxy_mass_kg);

}  // namespace proxarm::controller
