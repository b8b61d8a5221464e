// How far one axis of the tool may tilt from where it pointed at the start, and how far the tool may turn about it.
//
// With R_start the orientation at the start, R = R_start S W: W turns about the axis, and S, about one across it, tilts
// it. Both are sets onto which a step is projected, one after the other: the tilt is shortened with the twist as it is,
// and the other way round. Both are unique within 3 rad of the start (limits.max_turn_rad). Neither makes the angle
// from the start larger: cos ½θ = cos ½tilt cos ½twist.
#pragma once

#include <numbers>

#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct AxisRange {
  static constexpr double everything = std::numbers::pi;
  double max_tilt_rad = everything, max_twist_rad = everything;  // 0 to 3, or everything
  models::Vec3 axis_T = models::Vec3::UnitZ();                   // unit

  // Throws description::SetupError that names the key.
  void validate() const;
  [[nodiscard]] bool limits() const noexcept { return max_tilt_rad < everything || max_twist_rad < everything; }
  // How far this orientation is beyond, rad; negative within.
  [[nodiscard]] double beyond_rad(const Eigen::Quaterniond& start, const Eigen::Quaterniond& R) const noexcept;
  struct Step {
    double period_s = 1e-3, most_rad = 0.1;  // that it may turn the tool by
    double brakes_s = 0.1;                   // in which the border is approached
  };
  // Brings the orientation that a step leads to into what can be reached from `from` within a period, as the angle from
  // the start (orientation_proxy.hpp), by a step that is no longer, but for the way back of what is outside. Whether it
  // was beyond. Preconditions: all unit; `to` within 3 rad of the start and no further from `from` than a step may
  // lead.
  bool keep(const Eigen::Quaterniond& start, const Eigen::Quaterniond& from, const Step& step,
            Eigen::Quaterniond& to) const noexcept;
};

}  // namespace proxarm::controller
