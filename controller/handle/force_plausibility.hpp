// Detects forces that no hand makes, by the motion that follows them.
//
// ReversedForce: the sensor's sign, its mounting (turned by 180 degrees) or a joint's direction is wrong. A hand holds
// the handle like a spring of stiffness K. If the arm moves the wrong way, this spring drives it on: M ẍ = +K x less
// what damping and other springs take, so that the net force M ẍ is a straight line in the distance x, and both grow as
// e^λt. x is the distance from where the proxy would be if it had stayed at rest, or had gone on evenly since no force
// led it. The force is reversed if, in that time,
//
//   1. it has grown to 3 N and to twice of what it was at first, x along it to 6 mm, nothing was touched, and
//      no limit acted;
//   2. the straight line of their parts along the force, by least squares over all samples, explains 97 % of the
//      force's variance, and rises. (A joint that turns the other way turns one direction alone.)
//
// A hand whose net force begins as tⁿ makes x ~ t^(n+2), and a line explains 84 % for n = 1, when it begins to
// accelerate the arm, 92 % for n = 2, and 95 % for n = 3, when it sets out without a jerk. In 185 sessions of shipped
// and random hands it was 92 % at most. Of reversed forces under the same hands the line explained 97 % and more, but
// for those that are led to and fro meanwhile: there the hand's own motion hides the line. Where damping takes almost
// all of the force, above some 800 Ns/m, nothing is left to judge.
//
// StraightForce: nobody held the handle, and then a force leads the arm away that is a straight line in time, as a
// sensor's bias makes that drifts or has jumped. A hand's force bends as the handle moves. Two signs are judged:
//   straight   The residuals about the line, in the noisiest axis, have the variance that the noise had during the
//              tare, to within three standard deviations of that estimate, over a distance of 10 mm. The force is at
//              least 30 standard deviations of the noise. (10, if it is constant to 15 % and the speed has grown by
//              half.)
//   a jump     The force is there 30 ms after the handle was empty, and stays the same to a fifth for 10 mm. A hand
//              needs 50 ms or more to build up its force, and it yields.
// A load that acts at the handle may be as straight: it isn't judged.
#pragma once

#include "controller/handle/line_fit.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The hand's force without the tool's inertia, and the proxy after the last step. The mass is the whole one that the
// force moves, the tool's included.
struct ForceAndMotion {
  const models::Vec3& force_W;
  const models::Vec3& q_W;
  const models::Vec3& v_W;
  double mass_kg = 0.0;
  double period_s = 0.0;
  bool free = true;        // the proxy touches nothing
  bool limited = false;    // a limit held the proxy back in its last step
  bool at_handle = false;  // the force acts at the handle (hand_force.hpp), so it is no sensor's bias
};

class ReversedForce {
 public:
  void start() noexcept { state_ = {}; }
  // Returns true if the force is reversed.
  bool step(const ForceAndMotion& now) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    // Where the proxy rested last, or where no force led it, and its velocity there: it goes on from there.
    models::Vec3 rest_W = models::Vec3::Zero(), v_rest_W = models::Vec3::Zero();
    models::Vec3 v_k1_W = models::Vec3::Zero();  // in the last step
    double first_N = 0.0;                        // the net force there
    // Sums over the samples since then, of distance x and net force h.
    models::Vec3 x = models::Vec3::Zero(), h = models::Vec3::Zero();
    models::Mat3 xx = models::Mat3::Zero(), hh = models::Mat3::Zero(), xh = models::Mat3::Zero();
    double n = 0.0;
    bool judged = false;  // the proxy has touched nothing since
  };
  [[nodiscard]] bool is_line(const models::Vec3& along) const noexcept;

  State state_;
};

class StraightForce {
 public:
  void start() noexcept { state_ = {}; }
  // `empty`: nobody holds the handle. noise_N: the standard deviation of a sample, per axis. Returns true if no hand
  // makes this force.
  bool step(const ForceAndMotion& now, bool empty, double noise_N) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::Vec3 rest_W = models::Vec3::Zero();  // where the handle was empty last
    LineFit fit;
    double first_speed_m_per_s = 0.0;
    models::Vec3 jump_W = models::Vec3::Zero();  // the force 30 ms after the handle was empty
    double left_s = 0.0;                         // time since the handle was empty
    bool keeps = false;                          // the force is still jump_W to within a fifth
    bool judged = false;
  };
  [[nodiscard]] bool jumped(const ForceAndMotion& now, bool empty, double noise_N) noexcept;
  void add(const ForceAndMotion& now) noexcept;

  State state_;
};

}  // namespace proxarm::controller
