// Forces that no hand makes, told by the motion that follows them.
//
// ReversedForce: the sensor's sign, its mounting (turned by half a turn) or a joint's direction is wrong. A hand holds
// the handle by a stiffness; where the arm moves the wrong way that pushes it on, M ẍ + B ẋ = +K x: from rest force and
// distance grow as e^λt, together. So each time the proxy has gone twice as far from where it rested (0.5, 1, 2 … 64
// mm), for four doublings in a row
//   the force has grown by a factor of 1.45 to 2.1  (2 for e^λt, less for a bias on top; 2^(n/(n+2)) for a hand's force
//     that begins as tⁿ: 1.26 as it begins to accelerate the arm, and less later; more for one that the arm yields to).
//     The last of the four 1.6: as a bias counts less and less it comes near 2, and a hand that sets out without a jerk
//     (n = 3) stays at 1.52
//     Where damping takes most of the force (B > M λ, as the passivity damping can) 1.6: such a hand's is 2^(n/(n+1)),
//     1.41 for n = 1 and 1.59 for n = 2. Behind some 800 Ns/m a force that is the wrong way round isn't told from it
//   the doubling has taken 0.78 to 1.05 of ln 2/λ, with λ > 0 of M λ² + B λ = F/x   (1 for e^λt)
// Measured with grips of 150 to 1500 N/m: factors 1.50 to 1.99, times 0.82 to 0.99; of hands of a hundred random
// sessions none has both.
//
// StraightForce: nobody held the handle, and now its force leads the arm away along a straight line in time, as a
// sensor's bias does that drifts or has jumped. A hand's force bends as the handle moves. Straight: what is left in the
// noisiest axis beside the straight line has the variance that the noise had during the tare, to within three standard
// deviations of such an estimate, for 10 mm, at a force of 30 standard deviations of the noise (10, where it stays
// constant to 15 %). Or it has jumped: 30 ms after the handle was empty it is there, and keeps to a fifth for 10 mm. A
// hand needs 50 ms and more, and yields.
#pragma once

#include <array>

#include "controller/handle/line_fit.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The hand's force as it is measured, and the proxy that it moved in the step before.
struct ForceAndMotion {
  const models::Vec3& force_W;
  const models::Vec3& q_W;
  const models::Vec3& v_W;
  double mass_kg = 0.0, damping_Ns_per_m = 0.0;
  double period_s = 0.0;
  bool free = true;  // nothing is touched
};

class ReversedForce {
 public:
  void start() noexcept { state_ = {}; }
  // True: this force is the wrong way round.
  bool step(const ForceAndMotion& now) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  static constexpr std::size_t marks = 8;
  struct State {
    models::Vec3 rest_W = models::Vec3::Zero();  // where the proxy rested
    std::array<double, marks> force_N{};         // when it was 0.5 mm · 2^i from there
    std::array<double, marks> time_s{};          // since it rested
    double passed = 0.0;                         // marks so far
    double since_s = 0.0;
    bool judged = false;  // it rested, and has touched nothing since
  };
  [[nodiscard]] bool grows(std::size_t last, const ForceAndMotion& now) const noexcept;

  State state_;
};

class StraightForce {
 public:
  void start() noexcept { state_ = {}; }
  // `empty`: nobody holds the handle; noise_N: of a sample, per axis. True: no hand makes this force.
  bool step(const ForceAndMotion& now, bool empty, double noise_N) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::Vec3 rest_W = models::Vec3::Zero();  // where the empty handle was last
    LineFit fit;
    double first_speed_m_per_s = 0.0;
    models::Vec3 jump_W = models::Vec3::Zero();  // the force soon after the handle was empty
    double left_s = 0.0;                         // since then
    bool keeps = false;                          // it is that still
    bool judged = false;
  };
  [[nodiscard]] bool jumped(const ForceAndMotion& now, bool empty, double noise_N) noexcept;
  void add(const ForceAndMotion& now) noexcept;

  State state_;
};

}  // namespace proxarm::controller
