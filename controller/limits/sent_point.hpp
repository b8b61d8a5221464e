// The commanded point of the arm with lookahead: the place where the proxy will be, instead of the proxy itself.
//
//   p(k)    the proxy's place a horizon H after q(k), if it coasts there (rendering/lookahead.hpp)
//   c(k) =  the point of the limits' sets around c(k−1) that is nearest to p(k) + o(k)
//
// c never jumps:
//   - H approaches the wanted horizon by at most `horizon_rate` seconds per second. At speed v this moves c by at most
//     that share of v.
//   - Damping and spring act within H, so p jumps when they or the mass change. The offset o compensates: in that
//     cycle c goes on with its last velocity, and o then fades with `fading_s`.
//   - c follows p as fast as the sets of its own motion allow (speed, acceleration, power, leash). While borders or
//     joints hold c back, o is its distance from p. When they release c, it moves along with p, and o fades.
// The proxy keeps the same limits as without lookahead. The acceleration limit applies to a commanded point behind the
// setpoint filter, so the proxy has a separate filter here (x, v of step_limits.hpp), as if the arm were sent to the
// proxy.
//
// All in W. Nothing allocates, locks or throws.
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
  // A hand doesn't feel one per cent of the tool's speed. A change by 8 ms takes 0.8 s.
  static constexpr double horizon_rate = 0.01;
  // Three time constants of a setpoint filter of 10 Hz, so that the filter hardly reacts to the fading.
  static constexpr double fading_s = 0.05;

  SentPoint(const description::CellLimits& limits, double horizon_s, double period_s);

  void set_period(double period_s) noexcept;
  // Precondition: finite and ≥ 0; other values are ignored.
  void want(double horizon_s) noexcept;
  // Call when a parameter of p changes with the next step; o then absorbs the difference.
  void take_up_change() noexcept { state_.changes = true; }

  // Starts at rest at q_W; keeps the horizon.
  void start(const models::Vec3& q_W) noexcept;
  // The arm couldn't follow: c goes on from c_W and the proxy from q_W, both with velocity_W.
  void resume(const models::Vec3& c_W, const models::Vec3& q_W, const models::Vec3& velocity_W) noexcept;
  // Advances H by one period. Precondition: called before the proxy's step.
  void advance_horizon() noexcept;
  // Call after the proxy's step to q_W, with the predicted p(k). `limits`: the sets around c(k−1).
  void step(const models::Vec3& q_W, const models::Vec3& predicted_W, const StepLimits& limits) noexcept;

  // The arm was sent to c_W instead of the last c. They differ only by the curvature of the kinematics within a step.
  void correct(const models::Vec3& c_W) noexcept {
    state_.beside_W += c_W - state_.c_k1_W;
    state_.c_k1_W = c_W;
  }

  [[nodiscard]] double horizon_s() const noexcept { return state_.horizon_s; }
  [[nodiscard]] const models::Vec3& c_k1_W() const noexcept { return state_.c_k1_W; }
  [[nodiscard]] const models::Vec3& c_k2_W() const noexcept { return state_.c_k2_W; }
  // State x, v of the proxy's own filter.
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
