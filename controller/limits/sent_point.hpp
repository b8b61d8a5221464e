// The point that the arm is sent to with lookahead: not the proxy itself, but where the proxy is going to be.
//
//   p(k)    where the proxy will be a horizon H after q(k), if it coasts there (rendering/lookahead.hpp)
//   c(k) = the point of the limits' sets around c(k−1) that is nearest to p(k) + o(k)
//
// Nothing in c jumps:
//   - H moves to the wanted horizon at `horizon_rate` seconds per second at most. At the speed v this moves c by no
//     more than that share of v.
//   - Damping and spring act within H, so p would jump when one of them, or the mass, changes. The offset o compensates
//     for this: in the cycle of the change c goes on with its last velocity, and its offset from p then fades with
//     `fading_s`.
//   - c follows p as fast as the sets of its own motion allow (speed, acceleration, power, leash). Where borders or
//   joints
//     hold c back, o is the distance from p: c goes on with p when they let it go, and o fades.
// The proxy keeps the same limits as without lookahead. The limit of acceleration is one of a commanded point behind
// the setpoints' filter, so the proxy has such a filter of its own here (x, v of step_limits.hpp), as if the arm were
// sent to the proxy.
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
  // A hand doesn't feel a hundredth of the tool's speed. A change by 8 ms takes 0.8 s.
  static constexpr double horizon_rate = 0.01;
  // Three time constants of a setpoints' filter of 10 Hz, so that the filter hardly reacts to the fading.
  static constexpr double fading_s = 0.05;

  SentPoint(const description::CellLimits& limits, double horizon_s, double period_s);

  void set_period(double period_s) noexcept;
  // Precondition: finite and ≥ 0; anything else changes nothing.
  void want(double horizon_s) noexcept;
  // A parameter that p depends on changes with the next step, so o takes up the difference.
  void take_up_change() noexcept { state_.changes = true; }

  // Starts at rest at q_W; the horizon stays.
  void start(const models::Vec3& q_W) noexcept;
  // The arm couldn't follow: c goes on from c_W and the proxy from q_W, with this velocity.
  void resume(const models::Vec3& c_W, const models::Vec3& q_W, const models::Vec3& velocity_W) noexcept;
  // Advances H by one period. Precondition: called before the proxy's step.
  void advance_horizon() noexcept;
  // The proxy has stepped to q_W, and the scene leads it to predicted_W. `limits`: the sets around c(k−1).
  void step(const models::Vec3& q_W, const models::Vec3& predicted_W, const StepLimits& limits) noexcept;

  // The arm was sent to this place instead of the last c, by less than what its kinematics are curved within a step.
  void correct(const models::Vec3& c_W) noexcept {
    state_.beside_W += c_W - state_.c_k1_W;
    state_.c_k1_W = c_W;
  }

  [[nodiscard]] double horizon_s() const noexcept { return state_.horizon_s; }
  [[nodiscard]] const models::Vec3& c_k1_W() const noexcept { return state_.c_k1_W; }
  [[nodiscard]] const models::Vec3& c_k2_W() const noexcept { return state_.c_k2_W; }
  // x and v of the proxy's own filter.
  [[nodiscard]] const models::Vec3& filtered_W() const noexcept { return state_.x_W; }
  [[nodiscard]] const models::Vec3& filtered_velocity_W() const noexcept { return state_.v_W; }
  // The limits that were active in the last step.
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
