// Detects by the force alone that nobody holds the handle, so that the proxy can be brought to rest instead of
// coasting.
//
// A proxy of mass M without a hand keeps its speed, and a sensor's bias of some millinewtons accelerates it. The handle
// counts as empty while the hand's force, behind a low-pass of τ = 15 ms, stays within one of two bands:
//   noise band    8 σ_f + 4 σ/√n    for the time in which the proxy moves 20 mm, at least 0.06 s, at most 1.5 s
//   band          empty_handle_N    for the time in which it moves 40 mm, at least 0.5 s, at most 1.5 s; this band is
//                                   never narrower than the noise band
// σ is the standard deviation of a sample, per axis, while the sensor was tared. σ_f = σ √(T/2τ) is what the low-pass
// leaves of it (T: the period of the sensor's samples, if that is longer than the cycle's). σ/√n is the uncertainty of
// the bias, which is the mean of n samples. If the tare's samples weren't white noise, a hand may have moved the
// handle, and the noise band is empty_handle_N at most. A hand that moves the handle while it needs no force is in the
// narrow band only for milliseconds. A hand at rest can't be told from none, and loses nothing if it is taken for
// absent.
//
// The handle counts as held again when the force leaves 1.5 times the band, or at once when a single sample leaves it
// by 8 σ more, where the tool's inertia isn't in the samples. To that band, 1.5 times the inertial force of the tool
// behind the sensor is added: its mass times the largest acceleration of the last tenth of a second, with which its
// gears ring.
//
// A force that acts at the handle (hand_force.hpp) is a hand's or a load's, however straight: it never leads an empty
// one.
//
// While the handle is empty, a braking force −M v/τ_b, at most M a_b, replaces the hand's force. It is a force as any
// other: contacts, friction, springs and moving objects act as always, and nothing jumps.
#pragma once

#include "controller/handle/unexplained_way.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct EmptyHandleConfig {
  double band_N = 0.1;
  double tool_mass_kg = 0.0;  // what moves behind the sensor; rings as the arm is braked
  double lever_m = 0.0;       // a torque counts as its force at this lever; 0: torques don't count
  double way_share = 1.0;     // of the 20 and 40 mm
  bool at_once = true;        // a single sample beyond the band ends it; false: it may be the tool's inertia
};

// What one cycle shows of the hand.
struct HandSigns {
  const models::Wrench& hand_W;  // without bias, tool weight and the tool's inertia
  double noise_N = 0.0;          // σ; 0: not known
  bool noise_is_white = true;    // σ is the sensor's noise, not a hand's motion
  double tare_samples = 0.0;     // n
  double sample_cycles = 1.0;    // cycles from one sample to the next
  const models::Vec3& v_W;       // of the proxy, in its last step
  double mass_kg = 0.0;          // of the proxy
  bool at_handle = false;        // the force acts at the handle
  bool left_by_tare = false;     // it is what a hand left in the tare
  bool as_offset = false;        // it acts at the sensor's origin
  double unknown_N = 0.0;        // of it, what may be a weight that isn't the tool's in the cell
  bool limited = false;          // the tool's speed limit held the proxy back in its last step
};

class EmptyHandle {
 public:
  // How an empty handle is braked: from 0.45 m/s it stops within 5 cm, and a handle of 0.25 kg reads 1 N.
  static constexpr double braking_m_per_s2 = 4.0;

  EmptyHandle(const EmptyHandleConfig& config, double period_s) noexcept;

  // Begins with rendering: whether somebody holds the handle isn't known yet.
  void start() noexcept {
    state_ = {};
    way_.start();
  }
  void set_period(double period_s) noexcept;
  void set_tool_mass(double mass_kg) noexcept { config_.tool_mass_kg = mass_kg; }
  // To be called in each cycle of rendering. Returns true if nobody holds the handle.
  bool step(const HandSigns& signs) noexcept;

  [[nodiscard]] bool empty() const noexcept { return state_.empty; }
  // The handle counts as empty because a force that isn't a hand's led it (unexplained_way.hpp).
  [[nodiscard]] bool led() const noexcept { return state_.led; }
  // The handle is empty, and the proxy has stood for so long that what the sensor reads is its bias.
  [[nodiscard]] bool rests() const noexcept;
  // The hand's wrench behind the low-pass.
  [[nodiscard]] const models::Wrench& wrench_W() const noexcept { return state_.wrench_W; }
  // Replaces the hand's force while the handle is empty, for a proxy of this mass and velocity.
  [[nodiscard]] models::Vec3 braking_force_W(double mass_kg, const models::Vec3& v_W) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    state(way_);
  }

 private:
  struct State {
    models::Wrench wrench_W;
    models::Vec3 v_k1_W = models::Vec3::Zero();
    double acceleration_m_per_s2 = 0.0;          // largest of the last tenth of a second
    double calm_s = 0.0;                         // time within the noise band
    double quiet_s = 0.0;                        // time within the band
    double rest_s = 0.0;                         // time at rest with the handle empty
    double braking_m_per_s2 = 0.0;               // present bound of the braking; rises to a_b
    models::Vec3 bias_W = models::Vec3::Zero();  // the force that led the handle; zero: none did
    bool empty = false;
    bool led = false;  // see led()
  };

  [[nodiscard]] double size_N(const models::Wrench& wrench_W) const noexcept;
  void follow() noexcept;
  [[nodiscard]] static double longest_empty_s(const HandSigns& signs, double unknown_N) noexcept;

  EmptyHandleConfig config_;
  double period_s_;
  UnexplainedWay way_;
  State state_;
};

}  // namespace proxarm::controller
