// Measures how far a force has moved the handle without any sign that a hand makes this force.
//
// A hand is an impedance: its force changes with the motion that the force causes, and it trembles. A sensor's bias is
// constant or a straight line in time. So a straight line (least squares, each axis of W) is fitted to all samples
// since the force last bent. The force bends if the residual variance is more than
//   σ² (1 + d √(2/(n − 2))) + (s F)²
// σ is the sensor's noise, n the number of samples, d the accepted number of standard deviations of the estimated
// variance. s F is a share of the force F, for the oscillation of the tool behind the sensor as the arm starts.
//
// No hand leads the handle if the force hasn't bent while the handle moved 20 mm, the force now points along the
// motion, and one of these cases applies:
//
//   1. A bias that drifts or has jumped. The line began at rest (v₀ ≤ 10 mm/s plus the speed that the force adds in the
//      20 ms before its beginning is seen), and the force is now less than 1.5 N. The force needn't have accelerated
//      the proxy.
//   2. A larger bias that has jumped. The line began at rest and has changed by at most a fifth of its present value.
//      The force has accelerated the proxy by at least half as much as in free space.
//   3. A bias of any size and any beginning, drifting or not. The line has lasted for a second, and the force has
//      accelerated the proxy by at least half as much as in free space.
//   4. A force that is left over from a hand that pushed during the tare, or that acts at the sensor's origin
//      (hand_force.hpp).
//
// The force of a moving hand is occasionally straight for a tenth of a second. The force of a hand that begins to pull
// without tremor is occasionally straight for half a second, at some newtons.
//
// No function allocates, locks or throws.
#pragma once

#include "controller/handle/line_fit.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The force and motion of one cycle in which somebody may hold the handle.
struct LedHandle {
  const models::Vec3& force_W;  // the hand's force, without bias and tool weight
  const models::Vec3& v_W;      // the proxy's velocity
  double mass_kg = 0.0;
  double noise_N = 0.0;  // σ
  double period_s = 0.0;
  bool left_by_tare = false;  // the force is left over from a hand that pushed during the tare
  bool as_offset = false;     // the force acts at the sensor's origin (hand_force.hpp)
  bool limited = false;       // the tool's speed limit held the proxy back in its last step
};

class UnexplainedWay {
 public:
  void start() noexcept { state_ = {}; }
  // Call in each cycle in which somebody may hold the handle. Returns true if no hand led the handle to its place;
  // line_W() is then the force that the sensor reads without a hand.
  bool step(const LedHandle& now) noexcept;
  [[nodiscard]] const models::Vec3& line_W() const noexcept { return line_W_; }
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    LineFit fit;
    models::Vec3 way_W = models::Vec3::Zero();      // distance moved since the line began
    models::Vec3 first_v_W = models::Vec3::Zero();  // the proxy's velocity when the line began
    double free_s = 0.0;                            // time since the line began, without the cycles in which the tool's
                                                    // speed limit held the proxy back
  };
  void add(const LedHandle& now) noexcept;
  [[nodiscard]] bool leads(const LedHandle& now, const FittedLine& line) const noexcept;

  State state_;
  models::Vec3 line_W_ = models::Vec3::Zero();  // the line's end at the last test of the line
};

}  // namespace proxarm::controller
