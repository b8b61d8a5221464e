// Detects from the measured force alone that nobody holds the handle, so that the proxy is braked to rest and doesn't
// coast, driven by the sensor's bias.
//
// The handle counts as empty when the hand's force, behind a low-pass of τ = 15 ms, has stayed within one of two bands
// for long enough:
//   noise band    8 σ_f + 4 σ/√n    for as long as the proxy needs for 20 mm, 0.06 to 1.5 s
//   band          empty_handle_N    for as long as the proxy needs for 40 mm, 0.5 to 1.5 s; never narrower than the
//                                   noise band
// σ is the standard deviation of a sample, per axis, during the tare. σ_f = σ √(T/2τ) is the noise behind the low-pass;
// T is the sensor's period or the controller's period, whichever is longer. σ/√n is the uncertainty of the bias, a mean
// of n samples. If the noise wasn't white, a hand may have moved the handle during the tare; the noise band is then at
// most empty_handle_N. A moving hand that needs no force stays within the noise band only for milliseconds. A hand at
// rest looks like an empty handle, but loses nothing if it counts as absent.
//
// The handle counts as held again when the filtered force exceeds a threshold, the sum of three forces:
//   - 1.5 times the band
//   - 1.5 times the tool's inertial force: the mass behind the sensor times the largest acceleration of the last tenth
//     of a second
//   - a fifth of the force that led the handle (unexplained_way.hpp), if a force has led it
// With `at_once`, a single unfiltered sample that exceeds this threshold by 8 σ suffices. Precondition of `at_once`:
// the samples are free of the tool's inertia.
//
// A force that acts at the handle (hand_force.hpp) comes from a hand or a load. Such a force never makes the handle
// count as led, even if the force is straight in time.
//
// While the handle is empty, a braking force −M v/τ_b of at most M a_b replaces the hand's force. The proxy treats the
// braking force like any other force, so nothing jumps.
#pragma once

#include "controller/handle/unexplained_way.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct EmptyHandleConfig {
  double band_N = 0.1;
  double tool_mass_kg = 0.0;  // mass behind the sensor, which oscillates when the arm brakes
  double lever_m = 0.0;       // lever that converts a torque to a force; 0: torques don't count
  double way_share = 1.0;     // factor on the distances of 20 and 40 mm
  bool at_once = true;        // one sample far beyond the band suffices to count the handle as held; false: a single
                              // sample may be the tool's inertia
};

struct HandSigns {
  const models::Wrench& hand_W;  // the hand's wrench, without bias, tool weight and tool inertia
  double noise_N = 0.0;          // σ; 0: unknown
  bool noise_is_white = true;    // σ is the sensor's noise, not a hand's motion
  double tare_samples = 0.0;     // n
  double sample_cycles = 1.0;    // cycles from one sample of the sensor to the next
  const models::Vec3& v_W;       // the proxy's velocity in its last step
  double mass_kg = 0.0;          // the proxy's mass
  bool at_handle = false;        // the force acts at the handle
  bool left_by_tare = false;     // the force is left over from a hand that pushed during the tare
  bool as_offset = false;        // the force acts at the sensor's origin
  double unknown_N = 0.0;        // part of the force that may be weight missing from the arm's model
  bool limited = false;          // the tool's speed limit held the proxy back in its last step
};

class EmptyHandle {
 public:
  // Bound a_b of the braking. With it the proxy stops from 0.45 m/s within 5 cm, and the sensor reads 1 N from a handle
  // of 0.25 kg.
  static constexpr double braking_m_per_s2 = 4.0;

  EmptyHandle(const EmptyHandleConfig& config, double period_s) noexcept;

  // Call when rendering begins. Forgets whether the handle was held.
  void start() noexcept {
    state_ = {};
    way_.start();
  }
  void set_period(double period_s) noexcept;
  void set_tool_mass(double mass_kg) noexcept { config_.tool_mass_kg = mass_kg; }
  // Call once per cycle of rendering. Returns true if nobody holds the handle.
  bool step(const HandSigns& signs) noexcept;

  [[nodiscard]] bool empty() const noexcept { return state_.empty; }
  // Whether the handle counts as empty because a force that no hand makes has led it (unexplained_way.hpp).
  [[nodiscard]] bool led() const noexcept { return state_.led; }
  // Whether the handle is empty, and the proxy has stood long enough for the sensor's reading to be the sensor's bias.
  [[nodiscard]] bool rests() const noexcept;
  // The hand's wrench behind the low-pass.
  [[nodiscard]] const models::Wrench& wrench_W() const noexcept { return state_.wrench_W; }
  // Returns the force that replaces the hand's force while the handle is empty. mass_kg, v_W: the proxy's mass and
  // velocity.
  [[nodiscard]] models::Vec3 braking_force_W(double mass_kg, const models::Vec3& v_W) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    state(way_);
  }

 private:
  struct State {
    models::Wrench wrench_W;
    models::Vec3 v_k1_W = models::Vec3::Zero();
    double acceleration_m_per_s2 = 0.0;          // the proxy's largest in the last tenth of a second
    double calm_s = 0.0;                         // time within the noise band
    double quiet_s = 0.0;                        // time within the band
    double rest_s = 0.0;                         // time at rest with the handle empty
    double braking_m_per_s2 = 0.0;               // present bound of the braking; rises to a_b
    models::Vec3 bias_W = models::Vec3::Zero();  // the force that led the handle; zero: no force did
    bool empty = false;
    bool led = false;
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
