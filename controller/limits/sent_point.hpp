// Computes the commanded point c of the arm with lookahead: the place where the proxy will be, instead of the proxy's
// present place.
//
//   p(k)    the proxy's place a horizon H after q(k), if the proxy coasts (rendering/lookahead.hpp)
//   o(k)    an offset, usually zero
//   c(k) =  the point of the limits' sets around c(k−1) that is nearest to p(k) + o(k)
//
// c never jumps:
//   - H approaches the wanted horizon by at most `horizon_rate` seconds per second. At the proxy's speed v this changes
//     the speed of c by at most `horizon_rate` v.
//   - Damping and spring act on the proxy within H, so p jumps when damping, spring or mass change. In that cycle c
//     goes on with its last velocity; o takes up the difference, and then fades with `fading_s`.
//   - c follows p as fast as the limits of c's motion allow (speed, acceleration, power, leash). While borders or
//     joints hold c back, o = c − p. When they release c, c moves along with p, and o fades.
// The proxy keeps the limits that it has without lookahead. The acceleration limit applies to a commanded point behind
// the setpoint filter, so this class contains a filter for the proxy (x, v of step_limits.hpp), as if the arm were sent
// to the proxy.
//
// All vectors are in W. Nothing allocates, locks or throws.
#pragma once

#include "controller/limits/limit_sets.hpp"
#include "controller/limits/step_limits.hpp"
#include "models/base/archive_fields.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class SentPoint {
 public:
  // A hand doesn't feel a change of the arm's speed by one per cent. A change of the horizon by 8 ms takes 0.8 s.
  static constexpr double horizon_rate = 0.01;
  // Time constant of the offset's fading: three time constants of a setpoint filter of 10 Hz. So the filter hardly
  // reacts to the fading.
  static constexpr double fading_s = 0.05;

  SentPoint(const description::CellLimits& limits, double horizon_s, double period_s);

  void set_period(double period_s) noexcept;
  // Sets the wanted horizon. Values that aren't finite or are negative are ignored.
  void want(double horizon_s) noexcept;
  // Call when damping, spring or mass change with the next step; o then takes up the difference.
  void take_up_change() noexcept { state_.changes = true; }

  // Starts with c and proxy at rest at q_W; keeps the horizon.
  void start(const models::Vec3& q_W) noexcept;
  // Call if the arm couldn't follow: c continues from c_W, and the proxy from q_W, both with velocity_W.
  void resume(const models::Vec3& c_W, const models::Vec3& q_W, const models::Vec3& velocity_W) noexcept;
  // Advances H by one period. Precondition: called before the proxy's step.
  void advance_horizon() noexcept;
  // Computes c(k). Call after the proxy's step to q_W. predicted_W: p(k). `limits`: the sets around c(k−1).
  void step(const models::Vec3& q_W, const models::Vec3& predicted_W, const StepLimits& limits) noexcept;

  // Call if the arm was sent to c_W instead of the last c. The two places may differ only by the curvature of the
  // kinematics within a step.
  void correct(const models::Vec3& c_W) noexcept {
    state_.beside_W += c_W - state_.c_k1_W;
    state_.c_k1_W = c_W;
  }

  [[nodiscard]] double horizon_s() const noexcept { return state_.horizon_s; }
  [[nodiscard]] const models::Vec3& c_k1_W() const noexcept { return state_.c_k1_W; }
  [[nodiscard]] const models::Vec3& c_k2_W() const noexcept { return state_.c_k2_W; }
  // State x, v of the filter for the proxy.
  [[nodiscard]] const models::Vec3& filtered_W() const noexcept { return state_.x_W; }
  [[nodiscard]] const models::Vec3& filtered_velocity_W() const noexcept { return state_.v_W; }
  // Limits that were active in the last step.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }

  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    if (state.reading()) active_ = {};
  }

 private:
  struct State {
    models::Vec3 c_k1_W = models::Vec3::Zero(), c_k2_W = models::Vec3::Zero();
    models::Vec3 beside_W = models::Vec3::Zero();  // the offset o
    models::Vec3 x_W = models::Vec3::Zero(), v_W = models::Vec3::Zero();
    double horizon_s = 0.0, wanted_s = 0.0;
    bool changes = false;
  };

  void start_filter(const models::Vec3& q_W, const models::Vec3& velocity_W) noexcept;
  void filter(const models::Vec3& q_W) noexcept;

  double omega_rad_per_s_;
  double period_s_ = 0.0;
  double decay_ = 0.0;   // exp(−ωT)
  double fading_ = 0.0;  // exp(−T/fading_s)
  LimitSets<3> sets_;
  State state_;
  ActiveLimits active_;
};

}  // namespace proxarm::controller
