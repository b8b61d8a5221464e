// Limits how far an axis of the tool may tilt from its direction at the start, and how far the tool may twist about
// this axis.
//
// R_start: the orientation at the start. R = R_start S W, where W twists the tool about the axis, and S tilts the axis
// about a direction at right angles to it. A step is projected onto both sets in turn: the tilt is shortened at
// constant twist, and the twist is shortened at constant tilt. Tilt and twist are unique within 3 rad of the start
// (limits.max_turn_rad). Neither projection increases the angle θ from the start: cos ½θ = cos ½tilt cos ½twist.
#pragma once

#include <numbers>

#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct AxisRange {
  static constexpr double everything = std::numbers::pi;
  double max_tilt_rad = everything, max_twist_rad = everything;  // 0 to 3, or `everything`
  models::Vec3 axis_T = models::Vec3::UnitZ();                   // unit

  // Throws description::SetupError with the key's name.
  void validate() const;
  [[nodiscard]] bool limits() const noexcept { return max_tilt_rad < everything || max_twist_rad < everything; }
  // Returns the angle of R beyond the range, rad; negative if R is within the range.
  [[nodiscard]] double beyond_rad(const Eigen::Quaterniond& start, const Eigen::Quaterniond& R) const noexcept;
  struct Step {
    double period_s = 1e-3, most_rad = 0.1;  // most_rad: largest turn of the tool in the step
    double brakes_s = 0.1;                   // time in which the border is approached
  };
  // Limits the orientation `to` to those that can be reached from `from` within a period. A border is approached like
  // the limit of the angle from the start (turn_sets.hpp). The step gets no longer, unless the tool returns from beyond
  // the range. Returns whether `to` has changed.
  // Preconditions: all quaternions are unit; `to` is within 3 rad of the start and within one step of `from`.
  bool keep(const Eigen::Quaterniond& start, const Eigen::Quaterniond& from, const Step& step,
            Eigen::Quaterniond& to) const noexcept;
};

}  // namespace proxarm::controller
