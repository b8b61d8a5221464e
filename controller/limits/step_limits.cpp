#include "controller/limits/step_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace proxarm::controller {

using models::Vec3;

namespace {

// Share of the tool's speed limit that setpoints may use. Elastic gears add some 7 % to the tool's speed when the hand
// pulls the arm along at the limit.
constexpr double commanded_share = 0.9;

void add_plane(StepLimits& out, const LimitPlane<3>& plane) noexcept {
  if (out.plane_count < StepLimits::max_planes) out.planes[out.plane_count++] = plane;
}

}  // namespace

const char* limit_parameter(Limit limit) noexcept {
  switch (limit) {
    case Limit::leash:
      return "limits.leash_m";
    case Limit::power:
      return "limits.max_power_W";
    case Limit::workspace:
      return "limits.workspace_m";
    case Limit::keep_out:
      return "limits.keep_out_m";
    case Limit::joint_range:
      return "drives[].range_rad";
    case Limit::joint_speed:
      return "drives[].max_speed_rad_per_s";
    case Limit::joint_acceleration:
      return "drives[].max_acceleration_rad_per_s2";
    case Limit::speed:
      return "limits.max_tool_speed_m_per_s";
    case Limit::acceleration:
      return "limits.max_tool_acceleration_m_per_s2";
    case Limit::singularity:
      return "singularity or end of reach";
    case Limit::following_error:
      return "limits.following_error_rad";
    case Limit::joint_torque:
      return "drives[].max_torque_Nm";
    case Limit::guard_speed:
      return "guard of the setpoints: limits.max_tool_speed_m_per_s";
    case Limit::guard_elbow:
      return "guard of the setpoints: limits.max_elbow_speed_m_per_s";
    case Limit::guard_border:
      return "guard of the setpoints: limits.workspace_m, limits.keep_out_m";
    case Limit::guard_turning:
      return "guard of the setpoints: limits.max_turn_rad, max_tilt_rad, max_twist_rad, max_turning_speed_rad_per_s";
  }
  return "?";
}

StepLimiter::StepLimiter(const description::CellLimits& limits, double period_s)
    : limits_(limits), period_s_(period_s), omega_rad_per_s_(2.0 * std::numbers::pi * limits.setpoint_bandwidth_Hz) {}

void StepLimiter::make(const StepStart& start, FollowableStep* arm, StepLimits& out) const noexcept {
  out.soft_count = out.plane_count = out.hard_count = 0;
  out.arm = arm;
  out.q_k1_W = start.q_k1_W;
  add_balls(start, out);
  add_borders(start.q_k1_W, Borders::slow_down, out);
}

void StepLimiter::make_walls(const Vec3& q_W, StepLimits& out) const noexcept {
  out.soft_count = out.plane_count = out.hard_count = 0;
  out.arm = nullptr;
  out.q_k1_W = q_W;
  add_borders(q_W, Borders::walls, out);
}

void StepLimiter::add_balls(const StepStart& start, StepLimits& out) const noexcept {
  const double T = period_s_, omega = omega_rad_per_s_;
  const double v = commanded_share * std::min(limits_.max_tool_speed_m_per_s, start.max_speed_m_per_s);
  const double a = limits_.max_tool_acceleration_m_per_s2;
  out.soft[out.soft_count++] = {start.measured_W - start.q_k1_W, limits_.leash_m, Limit::leash};
  if (limits_.max_power_W > 0.0 && start.force_N * v > limits_.max_power_W) {
    out.soft[out.soft_count++] = {Vec3::Zero(), limits_.max_power_W / start.force_N * T, Limit::power};
  }
  out.hard[out.hard_count++] = {Vec3::Zero(), v * T, Limit::speed};
  if (omega > 0.0) {
    out.hard[out.hard_count++] = {start.filtered_W + 2.0 / omega * start.filtered_velocity_W - start.q_k1_W,
                                  a / (omega * omega), Limit::acceleration};
  } else {
    out.hard[out.hard_count++] = {start.q_k1_W - start.q_k2_W, a * T * T, Limit::acceleration};
  }
}

void StepLimiter::add_borders(const Vec3& q_W, Borders borders, StepLimits& out) const noexcept {
  const double T = period_s_;
  const double share = T / (T + limits_.max_tool_speed_m_per_s / limits_.max_tool_acceleration_m_per_s2);
  // A point beyond a border may not go further out.
  const auto room = [&](double d, double setback) {
    return borders == Borders::walls ? d : std::max(0.0, share * (d - setback));
  };
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double to_upper = limits_.workspace_max_m[k] - q_W[i], to_lower = q_W[i] - limits_.workspace_min_m[k];
    const double setback = border_setback_m(limits_.workspace_max_m[k] - limits_.workspace_min_m[k]);
    if (std::isfinite(to_upper)) {
      add_plane(out, {Vec3::Unit(i), room(to_upper, setback), ActiveLimits::of(Limit::workspace), share});
    }
    if (std::isfinite(to_lower)) {
      add_plane(out, {-Vec3::Unit(i), room(to_lower, setback), ActiveLimits::of(Limit::workspace), share});
    }
  }
  for (const description::BoxDescription& zone : limits_.keep_out) {
    const ActiveLimits limits = ActiveLimits::of(Limit::keep_out);
    LimitPlane<3> nearest{Vec3::UnitX(), -std::numeric_limits<double>::infinity(), limits};
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double below = zone.min_m[k] - q_W[i], above = q_W[i] - zone.max_m[k];
      if (below > nearest.bound_m) nearest = {Vec3::Unit(i), below, limits};
      if (above > nearest.bound_m) nearest = {-Vec3::Unit(i), above, limits};
    }
    nearest.bound_m = room(nearest.bound_m, longest_setback_m);
    nearest.share = share;
    add_plane(out, nearest);
  }
}

}  // namespace proxarm::controller
