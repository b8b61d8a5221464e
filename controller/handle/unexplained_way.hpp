// Measures how far a force has moved the handle without any sign that a hand makes it.
//
// A hand is an impedance: its force changes with the motion that it causes, and it trembles. A sensor's bias is
// constant or a straight line in time. So a straight line (least squares, each axis of W) is fitted to all samples
// since the force last bent. The force bends if the residual variance is more than
//   σ² (1 + d √(2/(n − 2))) + (s F)²
// σ is the sensor's noise, n the number of samples, d the accepted number of standard deviations of that estimate. s F
// is a share of the force, for the tool behind the sensor, which oscillates as the arm starts. No hand leads the handle
// if the force hasn't bent while the handle moved 20 mm, now points along the motion, and matches one of these cases:
//
//   - A bias that drifts or has jumped: the line began at rest (v₀ ≤ 10 mm/s plus the speed that the force adds before
//     its beginning is seen), and the force is now less than 1.5 N. It needn't have accelerated the proxy.
//   - A larger bias that has jumped: the line began at rest and has changed by at most a fifth of its present value;
//     the force has accelerated the proxy by at least half as much as in free space.
//   - A bias of any size and beginning, drifting or not: the line has lasted for a second, with the same acceleration.
//   - A force left over from a hand that pushed during the tare, or one that acts at the sensor's origin
//     (hand_force.hpp).
//
// The force of a moving hand is occasionally straight for a tenth of a second; that of a hand without tremor that
// begins to pull, for half a second at some newtons.
//
// No function allocates, locks or throws.
#pragma once

#include "controller/handle/line_fit.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The force and motion of one cycle in which somebody may hold the handle.
struct LedHandle {
  const models::Vec3& force_W;  // without bias and tool weight
  const models::Vec3& v_W;      // of the proxy
  double mass_kg = 0.0;
  double noise_N = 0.0;  // σ
  double period_s = 0.0;
  bool left_by_tare = false;
  bool as_offset = false;  // the force acts at the sensor's origin (hand_force.hpp)
  bool limited = false;    // the tool's speed limit held the proxy back in its last step
};

class UnexplainedWay {
 public:
  void start() noexcept { state_ = {}; }
  // Call in each cycle in which somebody may hold the handle. Returns true if no hand led the handle here; line_W() is
  // then the force that the sensor reads without a hand.
  bool step(const LedHandle& now) noexcept;
  [[nodiscard]] const models::Vec3& line_W() const noexcept { return line_W_; }
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    LineFit fit;
    models::Vec3 way_W = models::Vec3::Zero();      // distance moved since the line began
    models::Vec3 first_v_W = models::Vec3::Zero();  // the velocity when the line began
    double free_s = 0.0;                            // time since then, without the cycles in which a limit acted
  };
  void add(const LedHandle& now) noexcept;
  [[nodiscard]] bool leads(const LedHandle& now, const FittedLine& line) const noexcept;

  State state_;
  models::Vec3 line_W_ = models::Vec3::Zero();  // the line's end when it was last tested
};

}  // namespace proxarm::controller
