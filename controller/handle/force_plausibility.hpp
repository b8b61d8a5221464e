// Detects forces that no hand makes, from the motion that follows them.
//
// ReversedForce: the sensor's sign, its mounting (turned by 180 degrees) or a joint's direction is wrong. A hand holds
// the handle like a spring of stiffness K. If the arm moves the wrong way, this spring drives it on: M ẍ + B ẋ = +K x,
// so from rest both force and distance grow as e^λt. The motion is judged at each doubling of the distance from rest
// (0.5, 1, 2 … 64 mm). The force is reversed if four doublings in a row satisfy both conditions:
//
//   1. The force has grown by a factor of 1.45 to 2.1, and in the last doubling by at least 1.6. For e^λt the factor is
//      2. A bias on top of the force lowers it, but matters less and less. A hand whose force begins as tⁿ gives
//      2^(n/(n+2)): 1.26 for n = 1, when it begins to accelerate the arm, and less later; 1.52 for n = 3, when it sets
//      out without a jerk. If the arm yields to the force, the factor is larger.
//      If damping takes most of the force (B > M λ, possible with passivity damping), the factor must be at least
//      1.6, since such a hand gives 2^(n/(n+1)): 1.41 for n = 1 and 1.59 for n = 2. Above some 800 Ns/m a reversed
//      force looks like a hand's. The last factor must also be at least 0.85 of the largest. A bias makes the factors
//      rise towards 2; for a hand to which the arm yields they fall (2.00, 1.94, 1.51, 1.67: once in 18 hours of a
//      soak).
//   2. The doubling has taken 0.78 to 1.05 of ln 2/λ (1 for e^λt), where λ > 0 solves M λ² + B λ = F/x.
//
// Measured for reversed forces, with grips of 150 to 1500 N/m: factors of 1.50 to 1.99, times of 0.82 to 0.99. In a
// hundred random sessions no hand satisfied both conditions.
//
// StraightForce: nobody held the handle, and then a force moves the arm that is a straight line in time, like a sensor
// bias that drifts or has jumped. A hand's force bends as the handle moves. Two patterns are detected:
//   straight   Over a distance of 10 mm, the residuals about the line have the variance of the tare's noise, in the
//              noisiest axis, to within three standard deviations of that estimate. The force is at least 30 standard
//              deviations of the noise (10, if it is constant to 15 % and the speed has grown by half).
//   jump       The force exists 30 ms after the handle was last empty, and stays the same to a fifth for 10 mm. A hand
//              needs 50 ms or more to build up its force, and its force yields.
// A load that acts at the handle may be just as straight, so forces that act there aren't judged.
#pragma once

#include <array>

#include "controller/handle/line_fit.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The hand's force without the tool's inertia, and the proxy after its last step. mass_kg is the whole moved mass, the
// tool's included.
struct ForceAndMotion {
  const models::Vec3& force_W;
  const models::Vec3& q_W;
  const models::Vec3& v_W;
  double mass_kg = 0.0, damping_Ns_per_m = 0.0;
  double period_s = 0.0;
  bool free = true;        // the proxy touches nothing
  bool at_handle = false;  // the force acts at the handle (hand_force.hpp), so it isn't a sensor's bias
};

class ReversedForce {
 public:
  void start() noexcept { state_ = {}; }
  // Returns true if the force is reversed.
  bool step(const ForceAndMotion& now) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  static constexpr std::size_t marks = 8;
  struct State {
    models::Vec3 rest_W = models::Vec3::Zero();  // the proxy's last place of rest
    std::array<double, marks> force_N{};         // at the distance 0.5 mm · 2^i from rest_W
    std::array<double, marks> time_s{};          // time from rest to that distance
    double passed = 0.0;                         // marks passed so far
    double since_s = 0.0;
    bool judged = false;  // the proxy has rested, and has touched nothing since then
  };
  [[nodiscard]] bool grows(std::size_t last, const ForceAndMotion& now) const noexcept;

  State state_;
};

class StraightForce {
 public:
  void start() noexcept { state_ = {}; }
  // `empty`: nobody holds the handle. noise_N: standard deviation of a sample, per axis. Returns true if no hand makes
  // this force.
  bool step(const ForceAndMotion& now, bool empty, double noise_N) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::Vec3 rest_W = models::Vec3::Zero();  // the proxy's place when the handle was last empty
    LineFit fit;
    double first_speed_m_per_s = 0.0;
    models::Vec3 jump_W = models::Vec3::Zero();  // the force 30 ms after the handle was last empty
    double left_s = 0.0;                         // time since the handle was last empty
    bool keeps = false;                          // the force is still jump_W to within a fifth
    bool judged = false;
  };
  [[nodiscard]] bool jumped(const ForceAndMotion& now, bool empty, double noise_N) noexcept;
  void add(const ForceAndMotion& now) noexcept;

  State state_;
};

}  // namespace proxarm::controller
