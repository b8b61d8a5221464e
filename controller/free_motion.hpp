// How a person who is pinned gets free: slow motion of the tool out of a hold, without the scene and within all limits.
//
//   release    M v̇ = h − b v: the arm follows the hand's force, 10 N at 0.05 m/s
//   back off   along a direction n, v = √(2 a r) of what is left, r, at most the speed allowed
//
// Both make the velocity that is wanted next, and (26) with B = K_v = 0 in free space is given the force that leads to
// it, h = M (v − v₁)/T, so that all limits as sets apply as they do to rendering.
#pragma once

#include <memory>

#include "controller/rendered_world.hpp"
#include "controller/session_settings.hpp"
#include "fieldbus/state_archive.hpp"
#include "models/geometry.hpp"
#include "scenes/compile.hpp"

namespace proxarm::controller {

class FreeMotion {
 public:
  static constexpr double mass_kg = 10.0;               // M; with b a time constant of 50 ms
  static constexpr double damping_Ns_per_m = 200.0;     // b
  static constexpr double acceleration_m_per_s2 = 0.5;  // a, of backing off
  static constexpr double resisted_N = 50.0;            // more force against the motion than at its start ends it
  static constexpr double longest_back_off_m = 0.2;

  FreeMotion(const SessionSettings& settings, double speed_m_per_s);

  void set_period(double period_s) noexcept {
    period_s_ = period_s;
    world_->set_period(period_s);
  }
  [[nodiscard]] RenderedWorld& world() noexcept { return *world_; }
  [[nodiscard]] double speed_m_per_s() const noexcept { return speed_m_per_s_; }

  void start_release() noexcept { distance_m_ = 0.0; }
  // `n_W` is a unit vector.
  void start_back_off(const models::Vec3& start_W, const models::Vec3& n_W, double distance_m,
                      const models::Vec3& force_W) noexcept;
  [[nodiscard]] bool backs_off() const noexcept { return distance_m_ > 0.0; }

  // The force that takes the proxy at q with velocity v on, under the hand's force.
  [[nodiscard]] models::Vec3 force_W(const models::Vec3& q_W, const models::Vec3& v_W,
                                     const models::Vec3& hand_W) const noexcept;
  // Backing off: it is there, or the hand resists.
  [[nodiscard]] bool over(const models::Vec3& q_W, const models::Vec3& hand_W) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    world_->archive(state);
    state(start_W_, n_W_, distance_m_, against_N_);
  }

 private:
  [[nodiscard]] double left_m(const models::Vec3& q_W) const noexcept { return distance_m_ - n_W_.dot(q_W - start_W_); }

  scenes::CompiledScene scene_;  // empty
  std::unique_ptr<RenderedWorld> world_;
  double period_s_, speed_m_per_s_;
  models::Vec3 start_W_ = models::Vec3::Zero(), n_W_ = models::Vec3::UnitX();
  double distance_m_ = 0.0;  // to back off by; 0: release
  double against_N_ = 0.0;   // the hand's force against the motion when it began
};

}  // namespace proxarm::controller
