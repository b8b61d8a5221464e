// The proxy and its scene as the cycle sees them: a force in W goes in, the tool's next position in W comes out.
//
// The scene has n = 1, 2 or 3 dimensions. Its space is o + U x, with x in n coordinates and U an orthonormal 3×n basis.
// The component of the start position outside of that space is kept, so nothing jumps, and the proxy moves along the
// line or plane through the start.
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

// So many contacts of a step are told one by one.
using Touches = std::array<models::PoseContact, 8>;

// The result of one step of the proxy; all in W.
struct WorldStep {
  models::Vec3 q_W = models::Vec3::Zero();       // the new proxy
  models::Vec3 p_hat_W = models::Vec3::Zero();   // p̂: the proxy's position without a world
  models::Vec3 f_W = models::Vec3::Zero();       // the world's force on the proxy, (25a)
  models::Vec3 torque_W = models::Vec3::Zero();  // about q; of a rigid tool
  models::Vec3 v_W = models::Vec3::Zero();
  int contacts = 0;  // how many press
  // Those of them that are told; of a point without place and force. The world's own: they last until its next step.
  std::span<const models::PoseContact> touches;
  bool slips = false;
  bool unresolved = false;                             // 𝒢 found no solution that keeps all laws of contact
  ActiveLimits limits;                                 // that held the proxy back
  bool soft_limits_met = true;                         // whether leash and power were satisfied
  models::Vec3 limit_force_W = models::Vec3::Zero();   // the limits' force on the proxy; not in f_W
  models::Vec3 limit_torque_W = models::Vec3::Zero();  // likewise; of a rigid tool
  double mass_kg = 0.0, damping_Ns_per_m = 0.0;        // M and B of this step
  bool settled = false;  // the start was moved to where the scene allows it; the proxy rests there
  ProxyFault fault = ProxyFault::none;
};

// Tells the contacts of a step in `touches`, with their normals turned to W by the scene's basis. Precondition: `step`
// has none yet, and `touches` outlives it.
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

  // Sets the proxy to rest at q_W, and the spring's anchor, if there is a spring, to the same place. If an object or a
  // guide doesn't allow the proxy there, the first steps move it to where it may be, at rest, and ignore the force.
  virtual void start(const models::Vec3& q_W) noexcept = 0;
  // One period under the hand's force, within these limits. q_W of the result is always finite; after a fault it is
  // that of the step before.
  virtual WorldStep step(const models::Vec3& h_W, const StepLimits& limits) noexcept = 0;
  // Where the proxy will be `horizon_s` after its last step if h_W acts on it from there (lookahead.hpp): with h_W = 0
  // it coasts. Precondition: that step was made within the same limits. A world without lookahead returns the proxy
  // itself.
  virtual models::Vec3 look_ahead(const models::Vec3& h_W, const StepLimits& limits, double horizon_s) noexcept = 0;
  // The arm couldn't follow: the proxy goes on with this velocity, from the place nearest to q_W that the scene's
  // objects let it reach. Returns that place.
  virtual models::Vec3 resume(const models::Vec3& q_W, const models::Vec3& v_W) noexcept = 0;
  // Takes effect with the next step. Position and velocity stay, so nothing jumps. A value out of range changes
  // nothing.
  virtual void set(const Change& change) noexcept = 0;
  // The period of the steps to come. Precondition: the proxy is at rest. Moving objects don't jump, but their last step
  // had the old period.
  virtual void set_period(double period_s) noexcept = 0;
  // Adds damping to the user's from the next step on (passivity.hpp).
  virtual void add_damping(double damping_Ns_per_m) noexcept = 0;
  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;
};

// `proxy_mass_kg`: the wanted mass less that of the tool behind the sensor. Precondition: the scene outlives the
// result.
std::unique_ptr<RenderedWorld> make_rendered_world(scenes::CompiledScene& scene, const SessionSettings& settings,
                                                   double proxy_mass_kg);

}  // namespace proxarm::controller
