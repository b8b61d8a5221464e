// Monitored standstill: while the arm is meant to stand (in a hold that has come to rest, and while the sensor is
// tared), each joint must stay where its encoder reported it.
//
//   |θ(k) − θ(s)| > ε   is standstill_left,   ε = limits.following_error_rad,
// s is the first cycle in which the arm has stood for 0.2 s, which is several times the lag of a drive. ε is the
// deviation from its setpoint that the cell allows a drive at standstill. In the shipped scenes, drives that hold stay
// within 0.024 mrad, even while a hand leans on the tool. At 0.8 m, 1 mrad is 0.8 mm. An encoder that isn't heard in a
// cycle isn't judged in it, since feedback_late and drive_silent cover that.
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

  // To be called in each cycle, with the angles by the motors' encoders, the bits of those that were heard, and whether
  // the arm is meant to stand. Returns the first joint that moves.
  StandstillVerdict step(const models::JointVector& reported_rad, std::uint8_t fresh, bool stands,
                         double period_s) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::JointVector stood_rad;  // θ(s)
    double stands_s = 0.0;          // how long the arm has been meant to stand
  };

  double tolerance_rad_;
  State state_;
};

}  // namespace proxarm::controller
