// A band-pass filter for detecting oscillations. Forces and motions pass through the same filter, which keeps the phase
// between them.
//
// A Butterworth high-pass of order 4 removes deliberate hand motion. A Butterworth low-pass of order 2 acts only if a
// joint reports its position less often than the cycle runs: the reported position then stands still and jumps. The
// joint has f_r reports a second, so a report comes in every Nth cycle, N = 1/(f_r T). The low-pass's corner frequency
// f_c follows in three steps:
// 1. At a constant speed v, the speed per cycle has the mean square N v²: v² itself, and a ripple of (N − 1) v² at f_r
//    and beyond.
// 2. The low-pass leaves (f_c/f_r)⁴ of the ripple.
// 3. With f_c = f_r (left/(N − 1))^¼, the rest of the ripple is `left` = 0.02 of v². This is a tenth of the smallest
//    share that counts as an oscillation.
//
// At 200 reports a second and T = 1 ms, f_c is 53 Hz. There is no low-pass if all joints report in each cycle, or if
// f_c is near half of the cycle's rate.
#pragma once

#include <array>

#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct BandLimits {
  double low_Hz = 3.0;
  double report_rate_Hz = 0.0;  // f_r of the joint that reports least often; 0: all joints report in each cycle
};

class Band {
 public:
  void design(const BandLimits& limits, double period_s) noexcept;
  void reset() noexcept;
  // smooth() applies the low-pass, above() applies the high-pass to the result of smooth(), and step() does both.
  // Precondition: each filter is called once per cycle.
  models::Vec3 smooth(const models::Vec3& in) noexcept { return smooths_ ? top_.step(in) : in; }
  models::Vec3 above(const models::Vec3& smoothed) noexcept { return bottom_[1].step(bottom_[0].step(smoothed)); }
  models::Vec3 step(const models::Vec3& in) noexcept { return above(smooth(in)); }
  void archive(fieldbus::StateArchive& state) noexcept {
    for (Section* section : {&top_, &bottom_[0], &bottom_[1]}) state(section->s1, section->s2);
  }

 private:
  // A second-order filter in transposed direct form II: gain (1 ± 2z⁻¹ + z⁻²)/(1 + a₁z⁻¹ + a₂z⁻²).
  struct Section {
    double gain = 1.0, a1 = 0.0, a2 = 0.0;
    double b1 = -2.0;  // −2 of a high-pass, 2 of a low-pass
    models::Vec3 s1 = models::Vec3::Zero(), s2 = models::Vec3::Zero();
    void design(double omega, double inverse_quality, double b1_of_kind) noexcept;
    models::Vec3 step(const models::Vec3& in) noexcept;
  };
  bool smooths_ = false;
  Section top_;
  std::array<Section, 2> bottom_;
};

}  // namespace proxarm::controller
