// Nobody holds the handle: found out by the force alone, so that the proxy can be brought to rest instead of coasting.
//
// A proxy of mass M without a hand keeps its speed, and a sensor's bias of some millinewtons accelerates it. The handle
// counts as empty while the hand's force, behind a low-pass of 15 ms, is smaller than
//   a noise band    8 σ_f + 4 σ/√n    for as long as the proxy needs for 20 mm, at least 0.06 s
//   the band        empty_handle_N    for as long as it needs for 40 mm, at least 0.5 s; never below the noise band
// and 1.5 s are enough for both,
// with σ the standard deviation of a sample as it was while the sensor was tared, per axis, σ_f = σ √(T/2τ) what the
// low-pass leaves of it (T of the sensor's samples, where they come more seldom than the cycle), and σ/√n the
// uncertainty of the mean over n samples that was taken for the bias. Where the tare's samples weren't white noise, a
// hand may have moved the handle, and the noise band is empty_handle_N at most. A hand that leads the handle through a
// place where it needs no force is in the narrow band for milliseconds only; one that rests can't be told from none,
// and loses nothing by it.
//
// It is taken hold of again when the force leaves 1.5 times the band, and what the tool behind the sensor does by its
// own inertia: m times the largest acceleration of the last tenth of a second.
//
// While it is empty the proxy has, instead of the hand's force, one that brakes it: −M v/τ_b, at most M a_b. That is a
// force as any other: contacts, friction, springs and objects that move act as ever, and nothing jumps.
#pragma once

#include "controller/handle/unexplained_way.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct EmptyHandleConfig {
  double band_N = 0.1;
  double tool_mass_kg = 0.0;  // what moves behind the sensor
  double lever_m = 0.0;       // by which a force becomes a torque that counts as much; 0: torques don't count
};

// What one cycle tells of the hand.
struct HandSigns {
  const models::Wrench& hand_W;  // bias and tool weight taken off
  double noise_N = 0.0;          // σ; 0: not known
  bool noise_is_white = true;    // σ is the sensor's, and no hand's motion
  double tare_samples = 0.0;     // n
  double sample_cycles = 1.0;    // from one to the next
  const models::Vec3& v_W;       // of the proxy, in the step before
  double mass_kg = 0.0;          // its own
};

class EmptyHandle {
 public:
  EmptyHandle(const EmptyHandleConfig& config, double period_s) noexcept;

  // Rendering begins: whether somebody is there isn't known.
  void start() noexcept {
    state_ = {};
    way_.start();
  }
  void set_period(double period_s) noexcept;
  // Each cycle of rendering. True: nobody holds the handle.
  bool step(const HandSigns& signs) noexcept;

  [[nodiscard]] bool empty() const noexcept { return state_.empty; }
  // A force without a hand led it here.
  [[nodiscard]] bool led() const noexcept { return state_.led; }
  // Empty, and the proxy has stood for so long that what the sensor reads is its bias.
  [[nodiscard]] bool rests() const noexcept;
  // What the low-pass makes of the hand's wrench.
  [[nodiscard]] const models::Wrench& wrench_W() const noexcept { return state_.wrench_W; }
  // In place of the hand's force, for a proxy of this mass and velocity.
  [[nodiscard]] models::Vec3 braking_force_W(double mass_kg, const models::Vec3& v_W) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    state(way_);
  }

 private:
  struct State {
    models::Wrench wrench_W;
    models::Vec3 v_k1_W = models::Vec3::Zero();
    double acceleration_m_per_s2 = 0.0;          // the largest lately
    double calm_s = 0.0;                         // within the noise band
    double quiet_s = 0.0;                        // within the band
    double rest_s = 0.0;                         // empty, and at rest
    double braking_m_per_s2 = 0.0;               // what it brakes with at most, by now
    models::Vec3 bias_W = models::Vec3::Zero();  // what is read with nobody there; zero, unless it led the handle
    bool empty = false;
    bool led = false;  // it is empty because nothing showed a hand
  };

  [[nodiscard]] double size_N() const noexcept;
  void follow() noexcept;

  EmptyHandleConfig config_;
  double period_s_;
  UnexplainedWay way_;
  State state_;
};

}  // namespace proxarm::controller
