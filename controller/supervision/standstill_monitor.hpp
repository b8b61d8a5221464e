// Monitored standstill: where the arm is to stand (a hold that has come to rest, and while the sensor is tared), each
// joint stays where its encoder had it.
//
//   |θ(k) − θ(s)| > ε   is standstill_left,   ε = limits.following_error_rad,
// with s the first cycle in which the arm has stood for 0.2 s. ε is what the cell says that a drive may be off its
// setpoint while it stands still; drives that hold stay within 0.024 mrad of that in the shipped scenes, a hand that
// leans on the tool included, and 0.2 s are several times what they lag. At 0.8 m 1 mrad is 0.8 mm. An encoder that
// isn't heard in a cycle isn't judged in it: that is feedback_late's and drive_silent's.
#pragma once

#include <cstdint>

#include "controller/supervision/fault.hpp"
#include "models/arm/arm.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

inline constexpr double standstill_settled_s = 0.2;

struct StandstillVerdict {
  Fault fault = Fault::none;
  int joint = -1;
  double value_rad = 0.0, limit_rad = 0.0;
};

class StandstillMonitor {
 public:
  StandstillMonitor(int axes, double following_error_rad) noexcept : tolerance_rad_(following_error_rad) {
    state_.stood_rad.setZero(axes);
  }

  // Each cycle: angles by the motors' encoders, which of them were heard, and whether the arm is to stand. The first
  // joint that doesn't.
  StandstillVerdict step(const models::JointVector& reported_rad, std::uint8_t fresh, bool stands,
                         double period_s) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::JointVector stood_rad;  // θ(s)
    double stands_s = 0.0;          // for how long it has been to stand
  };

  double tolerance_rad_;
  State state_;
};

}  // namespace proxarm::controller
