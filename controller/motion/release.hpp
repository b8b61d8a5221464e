// How a person who is pinned gets free: the tool moves slowly out of a hold, without the scene and within all limits.
//
//   release    M v̇ = h − b v: the arm follows the hand's force, 10 N at 0.05 m/s
//   back off   along a direction n with v = √(2 a r), r the distance that is left, at most the speed allowed
//   yield      back off along the force that stopped the arm, until that is small: what it presses on may be somebody.
//              A force that doesn't fall on the first 5 mm isn't that of something pressed, or not read any more: a
//              sensor that lies, a hand that pulls. Then that is all
//
// Both compute the velocity v that is wanted next. (26) with B = K_v = 0 in free space is given the force that leads to
// it, h = M (v − v₁)/T, so that the limits apply as they do to rendering.
#pragma once

#include <memory>

#include "controller/rendering/rendered_world.hpp"
#include "controller/rendering/session_settings.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

class Release {
 public:
  static constexpr double mass_kg = 10.0;               // M; with b a time constant of 50 ms
  static constexpr double damping_Ns_per_m = 200.0;     // b
  static constexpr double acceleration_m_per_s2 = 0.5;  // a, of backing off
  static constexpr double resisted_N = 50.0;            // backing off ends when the hand resists by this much more
  static constexpr double longest_back_off_m = 0.2;
  static constexpr double longest_yield_m = 0.02;
  static constexpr double yielded_N = 20.0;      // that little is left pressed on
  static constexpr double relief_way_m = 0.005;  // on which the force falls
  static constexpr double relief_share = 0.15;   // by this much of it at least: 75 N of 500 on 10 N/mm are 50

  Release(const SessionSettings& settings, double speed_m_per_s);

  void set_period(double period_s) noexcept {
    period_s_ = period_s;
    world_->set_period(period_s);
  }
  [[nodiscard]] RenderedWorld& world() noexcept { return *world_; }
  [[nodiscard]] double speed_m_per_s() const noexcept { return speed_m_per_s_; }

  void start_release() noexcept { distance_m_ = pressed_N_ = 0.0; }
  // Precondition: `n_W` is a unit vector.
  void start_back_off(const models::Vec3& start_W, const models::Vec3& n_W, double distance_m,
                      const models::Vec3& force_W) noexcept;
  // Away from what presses with this force.
  void start_yield(const models::Vec3& start_W, const models::Vec3& force_W) noexcept;
  [[nodiscard]] bool backs_off() const noexcept { return distance_m_ > 0.0; }

  // The force for the next step of a proxy at q with velocity v, under the hand's force.
  [[nodiscard]] models::Vec3 force_W(const models::Vec3& q_W, const models::Vec3& v_W,
                                     const models::Vec3& hand_W) const noexcept;
  // Backing off has arrived, or the hand resists; yielding has come to where little presses, or doesn't help.
  [[nodiscard]] bool over(const models::Vec3& q_W, const models::Vec3& hand_W) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    world_->archive(state);
    state(start_W_, n_W_, distance_m_, against_N_, pressed_N_);
  }

 private:
  [[nodiscard]] double left_m(const models::Vec3& q_W) const noexcept { return distance_m_ - n_W_.dot(q_W - start_W_); }

  scenes::CompiledScene scene_;  // empty
  std::unique_ptr<RenderedWorld> world_;
  double period_s_, speed_m_per_s_;
  models::Vec3 start_W_ = models::Vec3::Zero(), n_W_ = models::Vec3::UnitX();
  double distance_m_ = 0.0;  // how far to back off; 0: release
  double against_N_ = 0.0;   // the hand's force against the motion when it began
  double pressed_N_ = 0.0;   // along the motion, when yielding began; 0: it doesn't yield
};

}  // namespace proxarm::controller
