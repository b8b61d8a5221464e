#include "controller/proxies/axis_range.hpp"

#include <algorithm>
#include <cmath>

#include "controller/proxies/turn_sets.hpp"
#include "models/base/option_check.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;

struct Turned {
  Vec3 tilt;     // rotation vector, at right angles to the axis
  double twist;  // rad, about the axis
};

Eigen::Quaterniond about(const Vec3& axis, double angle) noexcept { return models::rotation_by(angle * axis); }

Turned parts_of(const Eigen::Quaterniond& turn, const Vec3& axis) noexcept {
  const double sign = turn.w() < 0.0 ? -1.0 : 1.0;
  const double twist = 2.0 * std::atan2(sign * turn.vec().dot(axis), sign * turn.w());
  return {models::rotation_vector(turn * about(axis, -twist)), twist};
}

// Number of times that a step is shortened, since a step along both borders may be longer than allowed. Each shortening
// reduces the excess to about a thousandth, since a step is at most 0.1 rad long.
constexpr int kShorter = 3;

bool is_range(double most) noexcept { return (most >= 0.0 && most <= 3.0) || most == AxisRange::everything; }

}  // namespace

void AxisRange::validate() const {
  require_option(is_range(max_tilt_rad), "limits.max_tilt_rad", max_tilt_rad, "rad, from 0 to 3");
  require_option(is_range(max_twist_rad), "limits.max_twist_rad", max_twist_rad, "rad, from 0 to 3");
}

double AxisRange::beyond_rad(const Eigen::Quaterniond& start, const Eigen::Quaterniond& R) const noexcept {
  const Turned now = parts_of(start.conjugate() * R, axis_T);
  return std::max(now.tilt.norm() - max_tilt_rad, std::abs(now.twist) - max_twist_rad);
}

bool AxisRange::keep(const Eigen::Quaterniond& start, const Eigen::Quaterniond& from, const Step& step,
                     Eigen::Quaterniond& to) const noexcept {
  const Turned before = parts_of(start.conjugate() * from, axis_T);
  Turned now = parts_of(start.conjugate() * to, axis_T);
  const double tilt = now.tilt.norm();
  const double most_tilt = TurnSets::reachable_rad(before.tilt.norm(), max_tilt_rad, step.period_s, step.brakes_s);
  const double most_twist =
      TurnSets::reachable_rad(std::abs(before.twist), max_twist_rad, step.period_s, step.brakes_s);
  const bool tilted = max_tilt_rad < everything && tilt > most_tilt;
  const bool twisted = max_twist_rad < everything && std::abs(now.twist) > most_twist;
  if (!tilted && !twisted) return false;
  if (tilted) now.tilt *= most_tilt / tilt;
  if (twisted) now.twist = std::clamp(now.twist, -most_twist, most_twist);
  // The coordinates tilt and twist are curved, so the step to a border may be longer than the requested step. A longer
  // step would push the hand.
  const double asked = models::rotation_vector(to * from.conjugate()).norm();
  const double most_rad = std::min(step.most_rad, std::max(asked, TurnSets::returning_rad_per_s * step.period_s));
  double share = 1.0;
  for (int k = 0; k < kShorter; ++k) {
    const Vec3 tilt_now = before.tilt + share * (now.tilt - before.tilt);
    const double twist_now = before.twist + share * (now.twist - before.twist);
    to = (start * models::rotation_by(tilt_now) * about(axis_T, twist_now)).normalized();
    const double length = models::rotation_vector(to * from.conjugate()).norm();
    if (length <= most_rad) break;
    share *= most_rad / length;
  }
  return true;
}

}  // namespace proxarm::controller
