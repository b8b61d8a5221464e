// Limits how far an axis of the tool may tilt from its direction at the start, and how far the tool may twist about it.
//
// With R_start the orientation at the start, R = R_start S W: W twists about the axis; S tilts it, about an axis across
// it. A step is projected onto both sets in turn: the tilt is shortened at constant twist, and vice versa. Both are
// unique within 3 rad of the start (limits.max_turn_rad). Neither projection increases the angle from the start: cos ½θ
// = cos ½tilt cos ½twist.
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
  // Angle of this orientation beyond the range, rad; negative within.
  [[nodiscard]] double beyond_rad(const Eigen::Quaterniond& start, const Eigen::Quaterniond& R) const noexcept;
  struct Step {
    double period_s = 1e-3, most_rad = 0.1;  // largest turn of the tool
    double brakes_s = 0.1;                   // time in which the border is approached
  };
  // Limits the orientation `to` to those reachable from `from` within a period; borders as for the angle from the start
  // (turn_sets.hpp). The step gets no longer, except on the way back from outside. Returns whether `to` was beyond.
  // Preconditions: all unit; `to` within 3 rad of the start and within one step of `from`.
  bool keep(const Eigen::Quaterniond& start, const Eigen::Quaterniond& from, const Step& step,
            Eigen::Quaterniond& to) const noexcept;
};

}  // namespace proxarm::controller
