// Detects forces that no hand makes, from the motion that follows them.
//
// ReversedForce detects that the sensor's sign, the sensor's mounting (turned by 180 degrees) or a joint's direction is
// wrong. A hand holds the handle like a spring of stiffness K. If the arm moves the wrong way, the spring's force
// drives the arm on: M ẍ + B ẋ = +K x. From rest, force and distance then both grow as e^λt.
//
// The motion is judged at marks: the distances 0.5, 1, 2 … 64 mm from rest. A doubling is the motion from one mark to
// the next mark; its factor is the force at its end divided by the force at its beginning. The force is reversed if
// four successive doublings satisfy both conditions:
//
//   1. Each factor is 1.45 to 2.1. The last factor is at least 1.6, and at least 0.85 of the largest factor.
//      - For e^λt each factor is 2. A bias on top of the force makes the factors smaller. These factors rise towards
//        2, since the bias becomes an ever smaller share of the force.
//      - A hand's force that begins as tⁿ gives the factor 2^(n/(n+2)) as it begins to accelerate the arm, and smaller
//        factors later. The first factor is 1.26 for n = 1, and 1.52 for n = 3, a hand that begins without a jerk.
//      - If the arm yields to a hand, the factors are larger than 2^(n/(n+2)), but fall from doubling to doubling
//        (2.00, 1.94, 1.51, 1.67: once in 18 hours of a soak).
//      - If damping takes most of the force (B > M λ, possible with passivity damping), each factor must be at least
//        1.6, since a hand's force of tⁿ then gives 2^(n/(n+1)): 1.41 for n = 1 and 1.59 for n = 2. With a damping of
//        more than some 800 Ns/m a reversed force can't be told from a hand's force.
//   2. Each doubling has taken 0.78 to 1.05 times ln 2/λ, where λ > 0 solves M λ² + B λ = F/x. For e^λt it takes
//      ln 2/λ.
//
// Measured for reversed forces, with grips of 150 to 1500 N/m: factors of 1.50 to 1.99, times of 0.82 to 0.99 ln 2/λ.
// In a hundred random sessions no hand satisfied both conditions.
//
// StraightForce detects that the arm is moved from an empty handle by a force that is a straight line in time, like a
// sensor's bias that drifts or has jumped. A hand's force bends as the handle moves. Two patterns are detected:
//   straight   Over a distance of 10 mm, the variance of the residuals about the line exceeds the variance of the
//              tare's noise, in the noisiest axis, by at most three standard deviations of the estimated variance. The
//              force is at least 30 standard deviations of the noise (10, if the force is constant to 15 % and the
//              speed has grown by half).
//   jump       The force exists 30 ms after the handle was last empty, is then at least 20 standard deviations of the
//              noise, and stays constant to a fifth for 10 mm. A hand needs 50 ms or more to build up its force, and
//              the hand's force changes with the motion.
// A load that acts at the handle may be just as straight in time, so forces that act at the handle aren't judged.
#pragma once

#include <array>

#include "controller/handle/line_fit.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The hand's force without the tool's inertia, and the proxy's motion after its last step. mass_kg is the whole moved
// mass: the proxy's and the tool's.
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
    std::array<double, marks> force_N{};         // the force at mark i, the distance 0.5 mm · 2^i from rest_W
    std::array<double, marks> time_s{};          // the time from rest to mark i
    double passed = 0.0;                         // number of marks passed so far
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
