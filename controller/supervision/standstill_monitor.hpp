// Detects joints that move while the arm should stand, in a hold at rest and during the tare (monitored standstill).
//
//   |θ(k) − θ(s)| > ε   raises standstill_left,   ε = limits.following_error_rad
// θ: a motor encoder's angle. s: the last cycle before the arm has stood for 0.2 s, several times a drive's lag. ε is
// the deviation from its setpoint that the cell allows a drive at standstill; at 0.8 m, 1 mrad is 0.8 mm. In the
// shipped scenes, drives that hold stay within 0.024 mrad, even while a hand leans on the tool. A drive that hasn't
// answered in a cycle isn't judged in this cycle; the faults feedback_late and drive_silent are for missing answers.
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

  // Call in each cycle. reported_rad: the motor encoders' angles. `fresh`: bits of the drives that answered. `stands`:
  // the arm should stand. Returns the first joint that moves.
  StandstillVerdict step(const models::JointVector& reported_rad, std::uint8_t fresh, bool stands,
                         double period_s) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::JointVector stood_rad;  // θ(s)
    double stands_s = 0.0;          // time since the arm should stand
  };

  double tolerance_rad_;
  State state_;
};

}  // namespace proxarm::controller
