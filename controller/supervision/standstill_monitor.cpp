#include "controller/supervision/standstill_monitor.hpp"

#include <cmath>

namespace proxarm::controller {

StandstillVerdict StandstillMonitor::step(const models::JointVector& reported_rad, std::uint8_t fresh, bool stands,
                                          double period_s) noexcept {
  const bool settled = state_.stands_s >= standstill_settled_s;
  state_.stands_s = stands ? state_.stands_s + period_s : 0.0;
  if (!stands) return {};
  if (!settled) {
    state_.stood_rad = reported_rad;
    return {};
  }
  for (Eigen::Index i = 0; i < reported_rad.size(); ++i) {
    if ((fresh & 1u << i) == 0) continue;
    const double away_rad = std::abs(reported_rad[i] - state_.stood_rad[i]);
    // The condition is negated so that NaN counts as motion.
    if (!(away_rad <= tolerance_rad_)) {
      return {Fault::standstill_left, static_cast<int>(i), away_rad, tolerance_rad_};
    }
  }
  return {};
}

}  // namespace proxarm::controller
