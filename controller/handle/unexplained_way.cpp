#include "controller/handle/unexplained_way.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;

// Largest distance on one straight line. With nobody at the handle the arm may move 5 cm: twice this distance plus the
// braking distance.
constexpr double longest_way_m = 0.02;
// The line is tested every 10 samples. A test at each sample would now and then reject a good line by chance.
constexpr double looks = 10.0, deviations = 4.0;
// s, the share of the force that is allowed to the oscillation of the tool behind the sensor. This oscillation begins
// with 6 % of the force and decays. A hand of 100 N/m changes its force by 2 N over longest_way_m.
constexpr double share = 0.02;
// Smallest assumed noise of the sensor.
constexpr double least_noise_N = 0.005;
constexpr double rest_m_per_s = 0.01, seen_s = 0.02;
constexpr double small_N = 1.5, same_share = 0.2, accelerated_share = 0.5, long_s = 1.0;

}  // namespace

void UnexplainedWay::add(const LedHandle& now) noexcept {
  if (state_.fit.n == 0.0) state_ = {.fit = {}, .way_W = Vec3::Zero(), .first_v_W = now.v_W, .free_s = 0.0};
  state_.fit.add(now.force_W, now.period_s);
  state_.way_W += now.period_s * now.v_W;
  if (!now.limited) state_.free_s += now.period_s;
}

bool UnexplainedWay::leads(const LedHandle& now, const FittedLine& line) const noexcept {
  const State& s = state_;
  const Vec3 mean_W = s.fit.first_W + s.fit.h / s.fit.n;
  const double mean_N = mean_W.norm(), lasted_s = s.fit.n * now.period_s;
  if (!(line.end_W.dot(now.v_W) > 0.0) || !(now.mass_kg > 0.0)) return false;
  if (now.left_by_tare || now.as_offset) return true;
  const double gained = now.mass_kg * (now.v_W - s.first_v_W).dot(mean_W) / mean_N;
  const bool accelerates = gained >= accelerated_share * mean_N * s.free_s;
  const double now_N = line.end_W.norm();
  const bool from_rest = s.first_v_W.norm() <= rest_m_per_s + std::min(mean_N, now_N) / now.mass_kg * seen_s;
  if (from_rest && now_N < small_N) return true;
  const bool jumped = from_rest && line.risen_W.norm() <= same_share * now_N;
  return accelerates && (jumped || lasted_s >= long_s);
}

bool UnexplainedWay::step(const LedHandle& now) noexcept {
  add(now);
  const double n = state_.fit.n;
  if (n < looks || std::fmod(n, looks) != 0.0) return false;
  const FittedLine line = fitted(state_.fit, now.period_s);
  line_W_ = line.end_W;
  if (bends(line, std::max(now.noise_N, least_noise_N), deviations, share * line.end_W.norm())) {
    state_.fit.n = 0.0;
    return false;
  }
  return state_.way_W.norm() >= longest_way_m && leads(now, line);
}

}  // namespace proxarm::controller
