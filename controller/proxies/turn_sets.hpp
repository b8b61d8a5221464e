// Where a step may turn the tool: its speed, the angle from the orientation at the start, and tilt and twist of an
// axis.
//
// A set of angles is reached as a brake reaches a wall, in `brakes_s`, since joints can't stop at once. An orientation
// beyond a set is led back at `returning_rad_per_s`, not within a step.
#pragma once

#include "controller/proxies/axis_range.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct TurnSets {
  static constexpr double braking_s = 0.1;            // J/D with the default inertia and damping
  static constexpr double returning_rad_per_s = 0.1;  // slowly enough to be led by hand

  // What is sent leads the links by the gears' twist while joints accelerate them: by up to 1.9 mrad and 0.07 rad/s in
  // random sessions of six axes, by more where the joints of seven stop all at once. Sets end this much before the
  // limits of a cell, but by no larger share of them; where that is less, what is sent may lead beyond a limit.
  struct Lead {
    double most, share;
    [[nodiscard]] constexpr double before(double limit) const noexcept {
      return limit - (most < share * limit ? most : share * limit);
    }
  };
  static constexpr Lead lead_rad{2.5e-3, 0.1}, lead_rad_per_s{0.1, 0.4};
  // The sets in which setpoints stay that follow these. A guard that held them to the cell's limits instead would swing
  // where a limit is small: it stops all joints for what gears twist by.
  [[nodiscard]] TurnSets sent() const noexcept;

  Eigen::Quaterniond home = Eigen::Quaterniond::Identity();  // the orientation at the start
  double max_turn_rad = 0.7;                                 // from there, 0 to 3
  AxisRange axis_range{};
  double max_speed_rad_per_s = 2.0;
  double period_s = 1e-3;
  double brakes_s = braking_s;

  // Results of keep(): which sets held the step back.
  struct Held {
    bool speed = false, angle = false;
    [[nodiscard]] bool any() const noexcept { return speed || angle; }
  };
  // Brings the orientation `to` of a step from `from` into the sets: the nearest orientation about the same axis. An
  // orientation within them isn't changed. Precondition: both are unit.
  Held keep(const Eigen::Quaterniond& from, Eigen::Quaterniond& to) const noexcept;

  // How far this orientation is beyond the sets of angles, rad; negative within.
  [[nodiscard]] double beyond_rad(const Eigen::Quaterniond& R) const noexcept;

  // How far from the start the next step may lead, from `angle_rad` away.
  [[nodiscard]] static double reachable_rad(double angle_rad, double most_rad, double period_s,
                                            double brakes_s = braking_s) noexcept;
};

}  // namespace proxarm::controller
