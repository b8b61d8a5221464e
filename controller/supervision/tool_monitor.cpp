#include "controller/supervision/tool_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace proxarm::controller {

namespace {
constexpr double overshoot_share = 1.2, rounding_m = 1e-4;
}

ToolVerdict ToolMonitor::step(const models::Vec3& tool_W, double period_s) noexcept {
  const double off_m = off_limits(tool_W);
  if (count_ == 0) allowed_m_ = std::max(0.0, off_m);
  if (period_s != period_s_) places_.fill(tool_W);
  period_s_ = period_s;
  const double cycles = std::clamp(std::round(monitored_s / period_s), 1.0, static_cast<double>(most_places));
  const auto window = static_cast<std::uint32_t>(cycles);
  ToolVerdict verdict;
  if (count_ > 0) {
    // Less than a window after the start, the distance is measured from the start.
    const models::Vec3& before_W = places_[(count_ - std::min(count_, window)) % most_places];
    const double way_m = (tool_W - before_W).norm(), v = limits_.max_tool_speed_m_per_s;
    const double most_m =
        overshoot_share * v * cycles * period_s + v * (missed_cycles_ * period_s + 2.0 * feedback_s_) + rounding_m;
    if (way_m > most_m) {
      verdict = {Fault::tool_too_fast, way_m / (cycles * period_s), most_m / (cycles * period_s)};
    }
  }
  places_[count_ % most_places] = tool_W;
  // The count only has to tell which place is the oldest.
  count_ = count_ + 1 < 2 * most_places ? count_ + 1 : most_places;
  if (verdict.fault == Fault::none && off_m > allowed_m_ + off_limits_m) {
    verdict = {Fault::tool_off_limits, 1e3 * off_m, 1e3 * (allowed_m_ + off_limits_m)};
  }
  return verdict;
}

double ToolMonitor::off_limits(const models::Vec3& p) const noexcept {
  double off_m = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    off_m = std::max({off_m, p[i] - limits_.workspace_max_m[k], limits_.workspace_min_m[k] - p[i]});
  }
  for (const description::BoxDescription& zone : limits_.keep_out) {
    double depth_m = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      depth_m = std::min({depth_m, p[i] - zone.min_m[k], zone.max_m[k] - p[i]});
    }
    off_m = std::max(off_m, depth_m);
  }
  return off_m;
}

void ToolMonitor::archive(fieldbus::StateArchive& state) noexcept {
  state(count_, allowed_m_, period_s_);
  for (models::Vec3& place : places_) state(place);
}

}  // namespace proxarm::controller
