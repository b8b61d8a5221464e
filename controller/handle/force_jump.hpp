// Detects a force that changes within a sample by more than hand and handle can make: a sign or an axis that flips, an
// offset that jumps in.
//
// A hand is a mass on a spring: its force on the handle changes by at most stiffness times relative speed times the
// time between samples. 30,000 N/m (a fist's bones on steel) at 2 m/s are 60 N in a millisecond, which is
// max_force_step_N. A blow of steel on the handle may be faster, but it doesn't stay. Three signs are judged, of the
// load as it is read, which is the hand's wrench and the tool's weight (y, in S). It is held against what it would be
// if it went on as before, y⁻(n) = y(n−1) + trend, the trend being its change per sample over some four samples:
//
//   a flip      y(n) = R y⁻(n), R being −1 or half a turn about an axis of S, to 2 % and the noise, in forces and
//               torques alike, out of a force that went on as before: a swing through zero may be its own opposite from
//               one sample to the next. The sensor flips about its true zero, which is the bias or, if a hand leaned on
//               the handle while it was tared, the zero that is known. By at least 1 N where all six channels flip or
//               the tool's weight does; by 10 N where a hand's force alone might. Found with the first sample.
//   a turn that grows
//               half a turn of a hand's force by 1 to 10 N may be a script's, so it is watched for a second: if the
//               force then grows to 2.5 times what it was, along the same line and without another jump, the hand holds
//               back an arm that goes the wrong way.
//   a step      by more than max_force_step_N per millisecond, and for 5 ms it goes on as before but for a fifth of
//               itself. What a hand makes in a sample doesn't stay, and nor does a blow.
//               A release may be as fast: a step after which there is little force, or what was there within the 50 ms
//               before, is none.
//   an offset   by 20 standard deviations of the noise and by max_bias_drift_N at least, five times what the samples
//               before were off by, that stays like a step, and that doesn't act at the handle (hand_force.hpp).
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
  const models::Wrench& load_S;                       // without bias, the tool's weight included
  models::Vec3 hand_S = models::Vec3::Zero();         // of its force, what isn't the tool's weight
  models::Vec3 beside_zero_S = models::Vec3::Zero();  // by which the bias differs from the known zero
  double noise_N = 0.0;                               // standard deviation, in the noisiest axis
  double since_s = 0.0;                               // from the sample before
  double usual_s = 0.0;                               // from one sample to the next
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
    models::Wrench last_S, trend_S;                 // trend_S: change per sample
    models::Vec3 stepped_S = models::Vec3::Zero();  // the first force after the step that is watched, then its trend on
    models::Vec3 stepped_trend_S = models::Vec3::Zero();
    models::Vec3 before_S = models::Vec3::Zero();  // the force before that step
    double before_s = 1.0;                         // since then; long ago at the start
    double samples = 0.0;                          // in a row, up to two
    double calm_N = 0.0;                           // by how much the last ten samples or so were off what was expected
    double step_N = 0.0, limit_N = 0.0;
    double watched_s = -1.0;                       // since the step; below 0: none is watched
    models::Vec3 turned_S = models::Vec3::Zero();  // the hand's force after the turn that is watched
    double turned_s = -1.0;                        // since then; below 0: none is watched
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
