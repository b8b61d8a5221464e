// Detects a force that changes faster than a hand can change it, because a sign or axis of the sensor flips or an
// offset appears.
//
// A hand is a mass on a spring: its force on the handle changes by at most stiffness × relative speed × time between
// samples. 30,000 N/m (a fist's bones on steel) at 2 m/s give 60 N per millisecond, the default of max_force_step_N. A
// blow of steel may be faster, but its force doesn't stay. The detector compares the load y(n) (reading without bias,
// with the tool's weight, in S) with its extrapolation y⁻(n) = y(n−1) + trend; the trend is the change per sample,
// averaged over some four samples. It looks for four patterns:
//
//   flip        y(n) = R y⁻(n), where R is −1 or half a turn about an axis of S. Forces and torques both match, to 2 %
//               and the noise, and the samples before were calm: a swing through zero also yields its own opposite.
//               The sensor flips about its true zero: the bias, or the known zero if a hand leaned on the handle during
//               the tare. At least 1 N if all six channels or the tool's weight flip; 10 N if only the hand's force
//               does. Found with the first sample.
//   flip that   the hand's force makes half a turn of 1 to 10 N, which a scripted force may do as well. If the force
//   grows       then grows within a second to 2.5 times its size along the same line, without another jump, the hand
//               is holding back an arm that moves the wrong way.
//   step        more than max_force_step_N per millisecond, then within a fifth of the step for 5 ms. A hand's change
//               in one sample doesn't stay, nor does a blow. A release may be as fast: a step to little force, or back
//               to the force of up to 50 ms before, doesn't count.
//   offset      at least 20 standard deviations of the noise and max_bias_drift_N, and five times the recent deviations
//               from the extrapolation. It stays like a step, and it doesn't act at the handle (hand_force.hpp).
//
// With slower samples the bound rises in proportion. If the sensor's own filter takes longer than a few samples, a step
// becomes a ramp, which isn't detected. No function allocates, locks or throws.
#pragma once

#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct ForceJumpConfig {
  double max_step_N = 60.0;  // per millisecond
  double least_N = 0.5;      // smallest offset
  models::Vec3 handle_S = models::Vec3::Zero();
};

struct LoadSample {
  const models::Wrench& load_S;                       // without bias, with the tool's weight
  models::Vec3 hand_S = models::Vec3::Zero();         // its force without the tool's weight
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
  // Size of the jump, and its limit, after step() returned true.
  [[nodiscard]] double jump_N() const noexcept { return state_.step_N; }
  [[nodiscard]] double limit_N() const noexcept { return state_.limit_N; }

  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::Wrench last_S, trend_S;                 // trend_S: change per sample
    models::Vec3 stepped_S = models::Vec3::Zero();  // the first force after the watched step; extrapolated since
    models::Vec3 stepped_trend_S = models::Vec3::Zero();
    models::Vec3 before_S = models::Vec3::Zero();  // the force before the watched step
    double before_s = 1.0;                         // time since then; long ago at the start
    double samples = 0.0;                          // consecutive samples, up to two
    double calm_N = 0.0;                           // largest recent deviation from the extrapolation; decays over some
                                                   // ten samples
    double step_N = 0.0, limit_N = 0.0;
    double watched_s = -1.0;                       // time since the step; below 0: no step is watched
    models::Vec3 turned_S = models::Vec3::Zero();  // the hand's force after the watched flip
    double turned_s = -1.0;                        // time since then; below 0: no flip is watched
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
