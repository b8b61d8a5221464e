#include "controller/proxies/turn_sets.hpp"

#include <algorithm>
#include <cmath>

#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

using models::Vec3;

double TurnSets::reachable_rad(double angle_rad, double most_rad, double period_s, double brakes_s) noexcept {
  const double left = most_rad - angle_rad;
  if (left >= 0.0) return angle_rad + std::min(1.0, period_s / brakes_s) * left;
  return std::max(most_rad, angle_rad - returning_rad_per_s * period_s);
}

TurnSets TurnSets::sent() const noexcept {
  TurnSets out = *this;
  AxisRange& range = out.axis_range;
  out.max_turn_rad += lead_rad.most;
  if (range.max_tilt_rad < AxisRange::everything) range.max_tilt_rad += lead_rad.most;
  if (range.max_twist_rad < AxisRange::everything) range.max_twist_rad += lead_rad.most;
  out.max_speed_rad_per_s += lead_rad_per_s.most;
  return out;
}

double TurnSets::beyond_rad(const Eigen::Quaterniond& R) const noexcept {
  const double beyond = models::rotation_vector(R * home.conjugate()).norm() - max_turn_rad;
  return axis_range.limits() ? std::max(beyond, axis_range.beyond_rad(home, R)) : beyond;
}

TurnSets::Held TurnSets::keep(const Eigen::Quaterniond& from, Eigen::Quaterniond& to) const noexcept {
  Held held;
  const Vec3 turn = models::rotation_vector(to * from.conjugate());
  const double most_rad = max_speed_rad_per_s * period_s;
  if (turn.norm() > most_rad) {
    to = (models::rotation_by(most_rad / turn.norm() * turn) * from).normalized();
    held.speed = true;
  }
  const Vec3 angle = models::rotation_vector(to * home.conjugate());
  const double before_rad = models::rotation_vector(from * home.conjugate()).norm();
  const double most_angle_rad = reachable_rad(before_rad, max_turn_rad, period_s, brakes_s);
  if (angle.norm() > most_angle_rad) {
    to = (models::rotation_by(most_angle_rad / angle.norm() * angle) * home).normalized();
    held.angle = true;
  }
  if (axis_range.limits()) held.angle = axis_range.keep(home, from, {period_s, most_rad, brakes_s}, to) || held.angle;
  return held;
}

}  // namespace proxarm::controller
