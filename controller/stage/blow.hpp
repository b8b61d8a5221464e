// Measures the impulse of an impact, M v, which is what the hand receives. The impact's force isn't a useful measure:
// (26) stops a proxy within one step, so the force is M v/T for one cycle, hundreds of newtons that depend on the
// timestep.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "controller/record/cycle_record.hpp"

namespace proxarm::view {

class Blow {
 public:
  // How long a touch counts as an impact; the gears still ring then.
  static constexpr std::int64_t lasts_ns = 50'000'000;

  // Precondition: cycles come in order. After a gap in the cycles, counting starts with the next touch.
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
  // Returns the contact force beyond the hand's force, integrated over the first 50 ms of the last touch, Ns; NaN
  // before the first touch.
  [[nodiscard]] double impulse_Ns() const noexcept { return impulse_Ns_; }
  // Returns when the last touch began, s after the first cycle; NaN before the first touch.
  [[nodiscard]] double begun_s() const noexcept {
    return impulse_Ns_ >= 0.0 ? 1e-9 * static_cast<double>(begun_ns_) : impulse_Ns_;
  }

 private:
  bool touched_ = false;
  std::int64_t begun_ns_ = 0;
  double impulse_Ns_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace proxarm::view
