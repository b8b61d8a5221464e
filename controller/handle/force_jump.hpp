// Detects a force that changes faster than a hand can change it, because a sign or axis of the sensor flips or an
// offset appears.
//
// A hand is a mass on a spring: its force on the handle changes by at most stiffness × relative speed × time between
// samples. 30,000 N/m (a fist's bones on steel) at 2 m/s give 60 N per millisecond, the default of max_force_step_N. A
// blow of steel may change the force faster, but the force of a blow doesn't stay.
//
// The load y(n) is the reading without bias, with the tool's weight, in S. The detector compares the load with its
// extrapolation y⁻(n) = y(n−1) + trend; the trend is the change per sample, averaged over some four samples. The
// detector looks for four patterns:
//
//   flip        y(n) = R y⁻(n), where R is −1 or half a turn about an axis of S. Forces and torques both satisfy this
//               equation, to 2 % and the noise. The samples before were calm, since a force that swings through zero
//               also becomes its own opposite. The sensor flips about its true zero: the bias, or the known zero if a
//               hand leaned on the handle during the tare. The force changes by at least 1 N if all six channels or
//               the tool's weight flip, by at least 10 N if only the hand's force flips. One sample suffices.
//   flip that   The hand's force makes half a turn and changes by 1 to 10 N. A scripted force may do so as well. The
//   grows       hand is holding back an arm that moves the wrong way if the turned force then grows within a second to
//               2.5 times its size, along one line and without another jump.
//   step        The force changes by more than max_force_step_N per millisecond, and then stays for 5 ms, to within a
//               fifth of the step. The force of a hand or a blow that changes as fast doesn't stay. A hand that lets go
//               may be as fast, so two steps don't count: to a small force, and back to the force of up to 50 ms
//               before.
//   offset      The load differs from the extrapolation by at least 20 standard deviations of the noise, by at least
//               max_bias_drift_N, and by at least five times its recent difference. The new force stays for 5 ms, as
//               after a step, and doesn't act at the handle (hand_force.hpp).
//
// If the time between samples is longer than a millisecond, the bound of a step rises in proportion. If the sensor's
// own filter takes longer than a few samples, a step becomes a ramp, which isn't detected. No function allocates, locks
// or throws.
#pragma once

#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct ForceJumpConfig {
  double max_step_N = 60.0;  // max_force_step_N: a hand's largest change per millisecond
  double least_N = 0.5;      // smallest offset
  models::Vec3 handle_S = models::Vec3::Zero();
};

struct LoadSample {
  const models::Wrench& load_S;                       // the reading without bias, with the tool's weight
  models::Vec3 hand_S = models::Vec3::Zero();         // the load's force without the tool's weight
  models::Vec3 beside_zero_S = models::Vec3::Zero();  // the bias less the known zero
  double noise_N = 0.0;                               // standard deviation, in the noisiest axis
  double since_s = 0.0;                               // time since the previous sample
  double usual_s = 0.0;                               // usual time between samples
};

class ForceJump {
 public:
  explicit ForceJump(const ForceJumpConfig& config) noexcept : config_(config) {}

  void start() noexcept { state_ = {}; }
  // Returns true if a hand on the handle can't have made this sample, given those before.
  bool step(const LoadSample& sample) noexcept;
  // The size of the jump, and the limit that this size exceeds. Precondition: step() has returned true.
  [[nodiscard]] double jump_N() const noexcept { return state_.step_N; }
  [[nodiscard]] double limit_N() const noexcept { return state_.limit_N; }

  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::Wrench last_S, trend_S;                 // trend_S: change per sample
    models::Vec3 stepped_S = models::Vec3::Zero();  // the first force after the watched step, extrapolated to now
    models::Vec3 stepped_trend_S = models::Vec3::Zero();
    models::Vec3 before_S = models::Vec3::Zero();  // the force before the watched step
    double before_s = 1.0;                         // time since before_S was measured; at the start: long ago
    double samples = 0.0;                          // number of consecutive samples so far; no further than two
    double calm_N = 0.0;                           // largest recent deviation from the extrapolation; decays over some
                                                   // ten samples
    double step_N = 0.0, limit_N = 0.0;
    double watched_s = -1.0;                       // time since the watched step; below 0: no step is watched
    models::Vec3 turned_S = models::Vec3::Zero();  // the hand's force after the watched flip
    double turned_s = -1.0;                        // time since the watched flip; below 0: no flip is watched
  };

  [[nodiscard]] bool flipped(const LoadSample& sample, const models::Wrench& expected_S, double off_N) noexcept;
  [[nodiscard]] bool is_turned(const LoadSample& sample, const models::Wrench& turned_S, double step_N,
                               double step_Nm) const noexcept;
  [[nodiscard]] bool releases(const LoadSample& sample, double near_N) const noexcept;
  void watch(const LoadSample& sample, const models::Wrench& expected_S, double off_N) noexcept;
  [[nodiscard]] bool stayed(const LoadSample& sample) noexcept;
  [[nodiscard]] bool grows(const LoadSample& sample) noexcept;

  ForceJumpConfig config_;
  State state_;
};

}  // namespace proxarm::controller
