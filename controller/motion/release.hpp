// Frees a person who is pinned: from a hold, the tool moves slowly, without the scene and within all limits.
//
//   release    The arm follows the hand's force h: M v̇ = h − b v. 10 N give 0.05 m/s.
//   back off   The tool moves along a direction n at v = √(2 a r), at most at the allowed speed. r: remaining distance.
//   yield      The tool, which may be pressing on somebody, backs off along the force that stopped the arm. Yielding
//              ends when little of this force is left. It also ends if the force doesn't fall within the first 5 mm:
//              the tool then presses on nothing elastic; the sensor reads wrongly, or a hand pulls.
//
// Each of these computes the tool's next velocity v. The proxy reaches v in free space by (26) with B = K_v = 0 and the
// force h = M (v − v₁)/T, where v₁ is the last velocity. So all limits apply as in rendering.
#pragma once

#include <memory>

#include "controller/rendering/rendered_tool.hpp"
#include "controller/rendering/session_settings.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

class Release {
 public:
  static constexpr double mass_kg = 10.0;               // M; the time constant M/b is 50 ms
  static constexpr double damping_Ns_per_m = 200.0;     // b
  static constexpr double acceleration_m_per_s2 = 0.5;  // a, for speeding up and for braking while backing off
  static constexpr double resisted_N = 50.0;            // backing off ends when the hand's resistance has risen by this
  static constexpr double longest_back_off_m = 0.2;
  static constexpr double longest_yield_m = 0.02;
  static constexpr double yielded_N = 20.0;      // yielding ends below this force
  static constexpr double relief_way_m = 0.005;  // distance within which the force must fall
  // Share by which the force must fall: 500 N by 75 N. If the tool presses on an object of 10 N/mm, the force falls by
  // only 50 N.
  static constexpr double relief_share = 0.15;

  Release(const SessionSettings& settings, const OrientationConfig& orientation, double speed_m_per_s);

  void set_period(double period_s) noexcept {
    period_s_ = period_s;
    tool_.set_period(period_s);
  }
  [[nodiscard]] PointTool& tool() noexcept { return tool_; }
  [[nodiscard]] double speed_m_per_s() const noexcept { return speed_m_per_s_; }

  void start_release() noexcept { distance_m_ = pressed_N_ = 0.0; }
  // Precondition: `n_W` is a unit vector.
  void start_back_off(const models::Vec3& start_W, const models::Vec3& n_W, double distance_m,
                      const models::Vec3& force_W) noexcept;
  // Backs off from the object or person that presses with this force.
  void start_yield(const models::Vec3& start_W, const models::Vec3& force_W) noexcept;
  [[nodiscard]] bool backs_off() const noexcept { return distance_m_ > 0.0; }

  // Returns the force for the proxy's next step. q_W, v_W: the proxy's place and velocity.
  [[nodiscard]] models::Vec3 force_W(const models::Vec3& q_W, const models::Vec3& v_W,
                                     const models::Vec3& hand_W) const noexcept;
  // Whether the motion has ended. Backing off ends when the distance is covered or the hand resists. Yielding also ends
  // when little force is left, or if the force doesn't fall.
  [[nodiscard]] bool over(const models::Vec3& q_W, const models::Vec3& hand_W) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    tool_.archive(state);
    state(start_W_, n_W_, distance_m_, against_N_, pressed_N_);
  }

 private:
  [[nodiscard]] double left_m(const models::Vec3& q_W) const noexcept { return distance_m_ - n_W_.dot(q_W - start_W_); }

  scenes::CompiledScene scene_;  // empty
  PointTool tool_;
  double period_s_, speed_m_per_s_;
  models::Vec3 start_W_ = models::Vec3::Zero(), n_W_ = models::Vec3::UnitX();
  double distance_m_ = 0.0;  // distance to back off; 0: release
  double against_N_ = 0.0;   // the hand's force against the motion when backing off began
  double pressed_N_ = 0.0;   // the force along the motion when yielding began; 0: not yielding
};

}  // namespace proxarm::controller
