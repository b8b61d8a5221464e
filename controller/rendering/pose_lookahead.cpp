#include "controller/rendering/pose_lookahead.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {

using models::Mat3;
using models::Mat6;
using models::ToolPose;
using models::Vec3;

namespace {

// Returns the way of the reference point in `steps` periods without world and force, by (26). The last, incomplete step
// is interpolated.
Vec3 coasted_m(const PoseProxy& proxy, double steps) noexcept {
  const PoseConfig& config = proxy.config();
  const double T = config.period_s, m = config.mass_kg / (T * T), k_v = config.spring_N_per_m;
  const double kappa = m + config.damping_Ns_per_m / T + k_v;
  const Vec3 stretch = proxy.q().position - proxy.reference().position;
  Vec3 way = Vec3::Zero(), step = proxy.move().head<3>();
  for (; steps > 0.0; steps -= 1.0) {
    step = (m * step - k_v * (stretch + way)) / kappa;
    way += std::min(steps, 1.0) * step;
  }
  return way;
}

// Returns how far the proxy gets towards a plane in `steps` steps if each step keeps the plane's bound, which falls by
// `share` of each step: Σ b (1 − share)ⁱ.
double bound_ahead_m(double bound_m, double share, double steps) noexcept {
  if (!(share > 0.0)) return steps * bound_m;
  return bound_m * (1.0 - std::pow(std::max(0.0, 1.0 - share), steps)) / share;
}

}  // namespace

Vec3 PoseLookahead::operator()(const PoseProxy& proxy, const StepLimits& limits, double horizon_s) noexcept {
  const ToolPose& q = proxy.q();
  const double steps = horizon_s / proxy.config().period_s;
  const Vec3 way = coasted_m(proxy, steps);
  if (!way.allFinite() || way.isZero(0.0)) return q.position;
  make_limits(limits, q.position, way.norm(), steps);
  limits_.set_limits(ahead_, Mat3::Identity(), q.position);
  const double kappa = proxy.K()(0, 0);
  const Vec3 within = limits_(kappa, q.position + way, q.position);
  Mat6 K = Mat6::Zero();
  K.diagonal().head<3>().setConstant(kappa);
  K.diagonal().tail<3>().setConstant(proxy.holds_Nm_per_rad());
  if (g_->wants_time()) {
    g_->copy_state(*of_proxy_);
    g_->set_time({proxy.time_s() + horizon_s, horizon_s});
  }
  const ToolPose& ahead = g_->step(K, {within, q.orientation}, q);
  return g_->squeezed() || !ahead.position.allFinite() ? q.position : ahead.position;
}

// Makes the limits of the whole horizon out of those of the last step. The last step was made from limits.q_k1_W to
// q_W, which lowered the bounds of borders. Planes further away than `reach_m` are left out.
void PoseLookahead::make_limits(const StepLimits& limits, const Vec3& q_W, double reach_m, double steps) noexcept {
  ahead_.soft_count = ahead_.hard_count = ahead_.plane_count = 0;
  for (std::size_t i = 0; i < limits.hard_count; ++i) {
    if (limits.hard[i].limit != Limit::speed) continue;
    ahead_.hard[ahead_.hard_count] = limits.hard[i];
    ahead_.hard[ahead_.hard_count++].radius_m *= steps;
  }
  for (std::size_t i = 0; i < limits.soft_count; ++i) {
    if (limits.soft[i].limit != Limit::power) continue;
    ahead_.soft[ahead_.soft_count] = limits.soft[i];
    ahead_.soft[ahead_.soft_count++].radius_m *= steps;
  }
  const Vec3 way_W = q_W - limits.q_k1_W;
  for (std::size_t i = 0; i < limits.plane_count; ++i) {
    LimitPlane<3> plane = limits.planes[i];
    const double nearer_m = std::max(0.0, plane.share * plane.normal.dot(way_W));
    plane.bound_m = bound_ahead_m(std::max(0.0, plane.bound_m - nearer_m), plane.share, steps);
    if (plane.bound_m < reach_m) ahead_.planes[ahead_.plane_count++] = plane;
  }
}

}  // namespace proxarm::controller
