#include "controller/supervision/tool_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace proxarm::controller {

namespace {
constexpr double overshoot_share = 1.2, rounding_m = 1e-4;
}

ToolVerdict ToolMonitor::step(const models::Vec3& tool_W, double elbow_moved_m, double period_s) noexcept {
  const double off_m = off_limits(tool_W);
  if (count_ == 0) allowed_m_ = std::max(0.0, off_m);
  if (period_s != period_s_) {
    places_.fill(tool_W);
    elbow_moved_m_.fill(0.0);
    elbow_moved_m = 0.0;
  }
  period_s_ = period_s;
  const double cycles = std::clamp(std::round(monitored_s / period_s), 1.0, static_cast<double>(most_places));
  // Until W has passed since the start, the window begins at the start.
  const auto window = std::min(count_, static_cast<std::uint32_t>(cycles));
  elbow_moved_m_[count_ % most_places] = elbow_moved_m;
  ToolVerdict verdict = judge_speeds(tool_W, window, period_s);
  places_[count_ % most_places] = tool_W;
  // A large count_ is reduced without changing its places in the rings.
  count_ = count_ + 1 < 2 * most_places ? count_ + 1 : most_places;
  if (verdict.fault == Fault::none && off_m > allowed_m_ + off_limits_m) {
    verdict = {Fault::tool_off_limits, 1e3 * off_m, 1e3 * (allowed_m_ + off_limits_m)};
  }
  return verdict;
}

double ToolMonitor::most_way_m(double speed_m_per_s, double window_s, double period_s) const noexcept {
  return overshoot_share * speed_m_per_s * window_s + speed_m_per_s * (missed_cycles_ * period_s + 2.0 * feedback_s_) +
         rounding_m;
}

// Compares the motion in the last `window` cycles with the distance that is allowed in W.
ToolVerdict ToolMonitor::judge_speeds(const models::Vec3& tool_W, std::uint32_t window,
                                      double period_s) const noexcept {
  if (window == 0) return {};
  const double cycles = std::clamp(std::round(monitored_s / period_s), 1.0, static_cast<double>(most_places));
  const double window_s = cycles * period_s;
  const auto judge = [&](Fault fault, double way_m, double most_m) {
    return way_m > most_m ? ToolVerdict{fault, way_m / window_s, most_m / window_s} : ToolVerdict{};
  };
  const ToolVerdict tool = judge(Fault::tool_too_fast, (tool_W - places_[(count_ - window) % most_places]).norm(),
                                 most_way_m(limits_.max_tool_speed_m_per_s, window_s, period_s));
  if (tool.fault != Fault::none) return tool;
  double way_m = 0.0;
  for (std::uint32_t i = 0; i < window; ++i) way_m += elbow_moved_m_[(count_ - i) % most_places];
  return judge(Fault::elbow_too_fast, way_m, most_way_m(limits_.max_elbow_speed_m_per_s, window_s, period_s));
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
  state(count_, allowed_m_, period_s_, elbow_moved_m_);
  for (models::Vec3& place : places_) state(place);
}

}  // namespace proxarm::controller
