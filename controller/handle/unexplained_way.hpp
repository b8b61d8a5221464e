// How far a force has led the handle without showing that it is a hand's.
//
// A hand is an impedance: what it does changes with the motion that it makes, and it trembles. A sensor's bias doesn't
// know of the motion: it stays what it is, or goes along a straight line in time. So the force is held against the
// straight line through it since it was last seen to bend (least squares, in each axis of W). It bends where the
// variance beside the line is more than
//   σ² (1 + d √(2/(n − 2))) + (s F)²
// with σ the sensor's noise, n the samples, d the deviations of such an estimate that chance is granted, and s F a
// share of the force for the tool behind the sensor, which swings as the arm starts. Nobody leads a handle that has
// gone 20 mm along a force that hasn't bent on that way, and
//   began from rest (v₀ ≤ 10 mm/s, and what the force makes of the mass until its begin is seen), and is less than
//     1.5 N or stays the same to a fifth: a bias that drifts or has jumped
//   or has led it for a second, and accelerated it by half of what it would in free space at least
// A hand that is in motion is straight for a tenth of a second now and then, and one without tremor that begins to pull
// is for half a second, with some newtons.
//
// Neither allocates, locks nor throws.
#pragma once

#include "controller/handle/line_fit.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// Of one cycle in which somebody may hold the handle.
struct LedHandle {
  const models::Vec3& force_W;  // as it is read, bias and tool weight taken off
  const models::Vec3& v_W;      // of the proxy
  double mass_kg = 0.0;
  double noise_N = 0.0;  // σ
  double period_s = 0.0;
};

class UnexplainedWay {
 public:
  void start() noexcept { state_ = {}; }
  // Each such cycle. True: no hand led it here. Then line_W() is what is read without one.
  bool step(const LedHandle& now) noexcept;
  [[nodiscard]] const models::Vec3& line_W() const noexcept { return line_W_; }
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    LineFit fit;
    models::Vec3 way_W = models::Vec3::Zero();      // gone since the line began
    models::Vec3 first_v_W = models::Vec3::Zero();  // when the line began
  };
  void add(const LedHandle& now) noexcept;
  [[nodiscard]] bool leads(const LedHandle& now, const FittedLine& line) const noexcept;

  State state_;
  models::Vec3 line_W_ = models::Vec3::Zero();  // the line's end when it was last looked at
};

}  // namespace proxarm::controller
