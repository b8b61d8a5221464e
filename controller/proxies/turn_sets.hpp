// Limits how a step may turn the tool: by speed, by the angle from the orientation at the start, and by tilt and twist
// of an axis.
//
// The tool approaches the limit of an angle ever more slowly, with the time constant `brakes_s`, since joints can't
// stop at once. From beyond a limit the tool returns at `returning_rad_per_s`, not within one step.
#pragma once

#include "controller/proxies/axis_range.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct TurnSets {
  static constexpr double braking_s = 0.1;            // J/D with the default inertia and damping
  static constexpr double returning_rad_per_s = 0.1;  // slow enough for a hand to follow

  // The distance of the sets' borders from the cell's limits: `most`, but at most `share` of the limit. Reason: while
  // joints accelerate, setpoints lead the links by the gears' twist. This lead is up to 1.9 mrad and 0.07 rad/s in
  // random sessions of six axes, and more if the joints of seven axes all stop at once. If `share` of the limit is less
  // than the lead, setpoints may go beyond the limit.
  struct Lead {
    double most, share;
    [[nodiscard]] constexpr double before(double limit) const noexcept {
      return limit - (most < share * limit ? most : share * limit);
    }
  };
  static constexpr Lead lead_rad{2.5e-3, 0.1}, lead_rad_per_s{0.1, 0.4};
  // Returns the sets for setpoints of a tool that keeps these sets: wider by the lead. If the guard kept setpoints
  // within the cell's limits instead, the arm would oscillate at small limits, since the guard would stop all joints
  // because of the gears' twist.
  [[nodiscard]] TurnSets sent() const noexcept;

  Eigen::Quaterniond home = Eigen::Quaterniond::Identity();  // orientation at the start
  double max_turn_rad = 0.7;                                 // largest angle from home, 0 to 3
  AxisRange axis_range{};
  double max_speed_rad_per_s = 2.0;
  double period_s = 1e-3;
  double brakes_s = braking_s;

  // Result of keep(): the sets that held the step back.
  struct Held {
    bool speed = false, angle = false;
    [[nodiscard]] bool any() const noexcept { return speed || angle; }
  };
  // Brings the orientation `to` at the end of a step from `from` into the sets. Speed and angle are shortened without
  // changing the axis of the turn. An orientation within the sets doesn't change. Precondition: both are unit.
  Held keep(const Eigen::Quaterniond& from, Eigen::Quaterniond& to) const noexcept;

  // Returns the angle of R beyond the sets of angles, rad; negative if R is within them.
  [[nodiscard]] double beyond_rad(const Eigen::Quaterniond& R) const noexcept;

  // Returns the largest allowed angle after the next step, if the present angle is `angle_rad` and its limit
  // `most_rad`.
  [[nodiscard]] static double reachable_rad(double angle_rad, double most_rad, double period_s,
                                            double brakes_s = braking_s) noexcept;
};

}  // namespace proxarm::controller
