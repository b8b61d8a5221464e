// The impulse of an impact. (26) stops a proxy within one step: its force is then M v/T for a cycle, hundreds of
// newtons that say more of the timestep than of the touch. What a hand gets is the impulse, M v.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "controller/record/cycle_record.hpp"

namespace proxarm::view {

class Blow {
 public:
  // Of a touch's beginning, in which the gears still ring.
  static constexpr std::int64_t lasts_ns = 50'000'000;

  // Precondition: cycles come in their order; after a gap it counts from the next touch on.
  void add(const controller::CycleRecord& record) noexcept {
    const bool touches = record.contact != controller::ContactPhase::free;
    if (touches && !touched_) {
      begun_ns_ = record.time_ns;
      impulse_Ns_ = 0.0;
    }
    touched_ = touches;
    if (!touches || record.time_ns - begun_ns_ > lasts_ns) return;
    const double beyond_N =
        controller::vec3(record.contact_force_W_N).norm() - controller::vec3(record.force_W_N).norm();
    impulse_Ns_ += std::max(0.0, beyond_N) * 1e-9 * static_cast<double>(record.period_ns);
  }
  // Of the last touch's first 50 ms: what its force had beyond the hand's, Ns; NaN before the first touch.
  [[nodiscard]] double impulse_Ns() const noexcept { return impulse_Ns_; }
  // When that touch began, s after the first cycle; NaN before it.
  [[nodiscard]] double begun_s() const noexcept {
    return impulse_Ns_ >= 0.0 ? 1e-9 * static_cast<double>(begun_ns_) : impulse_Ns_;
  }

 private:
  bool touched_ = false;
  std::int64_t begun_ns_ = 0;
  double impulse_Ns_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace proxarm::view
