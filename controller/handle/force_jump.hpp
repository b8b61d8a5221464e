// Detects a force that changes within a sample by more than hand and handle can make: a sign or an axis that flips, an
// offset that jumps in.
//
// A hand is a mass on a spring: its force on the handle changes by at most stiffness times relative speed times the
// time between samples. 30,000 N/m (a fist's bones on steel) at 2 m/s are 60 N in a millisecond, which is
// max_force_step_N. A blow of steel on the handle may be faster, but it doesn't stay. Three signs are judged, of the
// load as it is read, which is the hand's wrench and the tool's weight (y, in S):
//
//   a flip      y(n) = R y(n−1), R being −1 or half a turn about an axis of S, to 2 % and the noise, in forces and
//               torques alike, out of a force that was calm: a swing through zero may be its own opposite from one
//               sample to the next. By at least 1 N where all six channels flip, the weight among them; by 10 N where a
//               hand's force alone might. Found with the first sample.
//   a step      by more than max_force_step_N per millisecond, and within 5 ms it doesn't change by more than a fifth
//   of
//               itself. What a hand makes in a sample doesn't stay, and nor does a blow.
//               A release may be as fast: a step after which there is little force, or what was there within the 50 ms
//               before, is none.
//   an offset   by 20 standard deviations of the noise and by max_bias_drift_N at least, out of a force that was calm,
//               that stays like a step, and that doesn't act at the handle (hand_force.hpp).
//
// With slower samples the bound rises as they do. A sensor whose own filter is slower than a few samples makes a ramp
// of a step, which isn't found here. Neither allocates, locks nor throws.
#pragma once

#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct ForceJumpConfig {
  double max_step_N = 60.0;  // per millisecond
  double least_N = 0.5;      // of an offset
  models::Vec3 handle_S = models::Vec3::Zero();
};

// A new sample.
struct LoadSample {
  const models::Wrench& load_S;                // without bias, the tool's weight included
  models::Vec3 hand_S = models::Vec3::Zero();  // of it, what isn't the tool's weight
  double noise_N = 0.0;                        // standard deviation, in the noisiest axis
  double since_s = 0.0;                        // from the sample before
  double usual_s = 0.0;                        // from one sample to the next
};

class ForceJump {
 public:
  explicit ForceJump(const ForceJumpConfig& config) noexcept : config_(config) {}

  void start() noexcept { state_ = {}; }
  // Returns true if hand and handle can't have made this sample of the ones before.
  bool step(const LoadSample& sample) noexcept;
  // By how much the force has jumped when step() returned true, and what was allowed.
  [[nodiscard]] double jump_N() const noexcept { return state_.step_N; }
  [[nodiscard]] double limit_N() const noexcept { return state_.limit_N; }

  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::Wrench last_S, stepped_S;              // stepped_S: the first load after the step that is being watched
    models::Vec3 before_S = models::Vec3::Zero();  // the force before that step
    double before_s = 1.0;                         // since then; long ago at the start
    double samples = 0.0;                          // in a row, up to two
    double calm_N = 0.0;                           // by how much the force changed in the sample before
    double step_N = 0.0, limit_N = 0.0;
    double watched_s = -1.0;  // since the step; below 0: none is watched
  };

  [[nodiscard]] bool flipped(const LoadSample& sample) noexcept;
  [[nodiscard]] bool releases(const LoadSample& sample, double near_N) const noexcept;
  void watch(const LoadSample& sample, double step_N) noexcept;
  [[nodiscard]] bool stayed(const LoadSample& sample) noexcept;

  ForceJumpConfig config_;
  State state_;
};

}  // namespace proxarm::controller
