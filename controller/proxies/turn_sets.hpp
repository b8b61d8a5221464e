// Limits of how a step may turn the tool: speed, angle from the orientation at the start, and tilt and twist of an
// axis.
//
// A limit of an angle is approached like a wall by a brake, within `brakes_s`, since joints can't stop at once. An
// orientation beyond a limit returns at `returning_rad_per_s`, not within a step.
#pragma once

#include "controller/proxies/axis_range.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct TurnSets {
  static constexpr double braking_s = 0.1;            // J/D with the default inertia and damping
  static constexpr double returning_rad_per_s = 0.1;  // slow enough for a hand to follow

  // While joints accelerate, setpoints lead the links by the gears' twist: by up to 1.9 mrad and 0.07 rad/s in random
  // sessions of six axes, by more if the joints of seven axes stop all at once. So the sets end this much before the
  // cell's limits, but at most by the given share. If the share is smaller, setpoints may go beyond a limit.
  struct Lead {
    double most, share;
    [[nodiscard]] constexpr double before(double limit) const noexcept {
      return limit - (most < share * limit ? most : share * limit);
    }
  };
  static constexpr Lead lead_rad{2.5e-3, 0.1}, lead_rad_per_s{0.1, 0.4};
  // The sets for the setpoints that follow these. A guard that held setpoints to the cell's limits would oscillate at
  // small limits, since it stops all joints because of the gears' twist.
  [[nodiscard]] TurnSets sent() const noexcept;

  Eigen::Quaterniond home = Eigen::Quaterniond::Identity();  // orientation at the start
  double max_turn_rad = 0.7;                                 // from home, 0 to 3
  AxisRange axis_range{};
  double max_speed_rad_per_s = 2.0;
  double period_s = 1e-3;
  double brakes_s = braking_s;

  // Result of keep(): the sets that held the step back.
  struct Held {
    bool speed = false, angle = false;
    [[nodiscard]] bool any() const noexcept { return speed || angle; }
  };
  // Brings the orientation `to` of a step from `from` into the sets: the nearest orientation about the same axis.
  // Leaves an orientation within them unchanged. Precondition: both are unit.
  Held keep(const Eigen::Quaterniond& from, Eigen::Quaterniond& to) const noexcept;

  // Angle of this orientation beyond the sets of angles, rad; negative within.
  [[nodiscard]] double beyond_rad(const Eigen::Quaterniond& R) const noexcept;

  // Largest angle from the start after the next step, from `angle_rad`.
  [[nodiscard]] static double reachable_rad(double angle_rad, double most_rad, double period_s,
                                            double brakes_s = braking_s) noexcept;
};

}  // namespace proxarm::controller
