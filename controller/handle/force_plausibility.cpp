#include "controller/handle/force_plausibility.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;

// Below this speed the proxy counts as at rest. A hand that holds still trembles as fast.
constexpr double at_rest_m_per_s = 2e-3;
constexpr double first_mark_m = 0.5e-3;
constexpr std::size_t doublings = 4;
constexpr double least_growth = 1.45, least_last_growth = 1.6, least_damped_growth = 1.6, most_growth = 2.1;
constexpr double kept_growth = 0.85;  // the last factor, as a share of the largest
constexpr double least_time = 0.78, most_time = 1.05;
// Smallest judged force, a hundred times the noise of a usual sensor. Ratios of smaller forces are unreliable.
constexpr double least_force_N = 2.0;

constexpr double near_m = 1e-3, far_m = 1e-2;
// The line is tested every 30 samples. A test at each sample would now and then reject a good line by chance.
constexpr double looks = 30.0, bend_noises = 3.0;
// jump_share allows for the oscillation of the tool behind the sensor as the arm starts.
constexpr double jump_s = 0.03, jump_share = 0.2, jump_noises = 20.0;
constexpr double ramp_noises = 30.0, constant_noises = 10.0, constant_share = 0.15, speed_gain = 1.5;

}  // namespace

bool ReversedForce::grows(std::size_t last, const ForceAndMotion& now) const noexcept {
  const State& s = state_;
  if (last < doublings || s.force_N[last] < least_force_N) return false;
  double largest = 0.0, growth = 0.0;
  for (std::size_t i = last + 1 - doublings; i <= last; ++i) {
    // λ solves M λ² + B λ = F/x.
    const double M = now.mass_kg, B = now.damping_Ns_per_m;
    const double stiffness = s.force_N[i] / (first_mark_m * std::exp2(static_cast<double>(i)));
    const double lambda = (std::sqrt(B * B + 4.0 * M * stiffness) - B) / (2.0 * M);
    growth = s.force_N[i] / s.force_N[i - 1];
    largest = std::max(largest, growth);
    const double least = B > M * lambda ? least_damped_growth : i == last ? least_last_growth : least_growth;
    if (!(growth >= least && growth <= most_growth)) return false;
    const double took = (s.time_s[i] - s.time_s[i - 1]) * lambda / std::log(2.0);
    if (took < least_time || took > most_time) return false;
  }
  return growth >= kept_growth * largest;
}

bool ReversedForce::step(const ForceAndMotion& now) noexcept {
  State& s = state_;
  if (now.v_W.norm() < at_rest_m_per_s) {
    s = {.rest_W = now.q_W, .force_N = {}, .time_s = {}, .passed = 0.0, .since_s = 0.0, .judged = now.free};
    return false;
  }
  s.judged = s.judged && now.free && now.mass_kg > 0.0;
  s.since_s += now.period_s;
  if (!s.judged) return false;
  const double way_m = (now.q_W - s.rest_W).norm();
  bool found = false;
  for (auto i = static_cast<std::size_t>(s.passed); i < marks && way_m >= first_mark_m * std::exp2(s.passed); ++i) {
    s.force_N[i] = now.force_W.norm();
    s.time_s[i] = s.since_s;
    s.passed += 1.0;
    found = found || grows(i, now);
  }
  return found;
}

void StraightForce::add(const ForceAndMotion& now) noexcept {
  if (state_.fit.n == 0.0) state_.first_speed_m_per_s = now.v_W.norm();
  state_.fit.add(now.force_W, now.period_s);
}

// Whether the force still equals, to within a fifth, the force of 30 ms after the handle was last empty, and has moved
// the proxy by far_m.
bool StraightForce::jumped(const ForceAndMotion& now, bool empty, double noise_N) noexcept {
  State& s = state_;
  if (empty) {
    s.left_s = 0.0;
    s.keeps = now.free;
    return false;
  }
  s.left_s += now.period_s;
  if (s.left_s <= jump_s) s.jump_W = now.force_W;
  const double jump_N = s.jump_W.norm();
  s.keeps = s.keeps && now.free && (now.force_W - s.jump_W).norm() <= jump_share * jump_N;
  if (!s.keeps || s.left_s <= jump_s || jump_N < jump_noises * noise_N) return false;
  const Vec3 gone_W = now.q_W - s.rest_W;
  return gone_W.norm() >= far_m && gone_W.dot(s.jump_W) > 0.0;
}

bool StraightForce::step(const ForceAndMotion& now, bool empty, double noise_N) noexcept {
  State& s = state_;
  if (empty) {
    s.rest_W = now.q_W;
    s.judged = now.free;
  }
  s.judged = s.judged && now.free && !now.at_handle;
  s.keeps = s.keeps && !now.at_handle;
  if (jumped(now, empty, noise_N)) return true;
  // While the handle is empty, the tracking of the bias bends the line.
  if (!s.judged || empty) {
    s.fit.n = 0.0;
    return false;
  }
  add(now);
  const Vec3 gone_W = now.q_W - s.rest_W;
  const bool went = gone_W.norm() >= far_m;
  if (s.fit.n < looks || (!went && std::fmod(s.fit.n, looks) != 0.0)) return false;
  const FittedLine line = fitted(s.fit, now.period_s);
  if (bends(line, noise_N, bend_noises)) {
    s.fit.n = 0.0;
    s.judged = gone_W.norm() <= near_m;
    return false;
  }
  if (!went || gone_W.dot(line.end_W) <= 0.0) return false;
  const double force_N = line.end_W.norm();
  if (force_N >= ramp_noises * noise_N) return true;
  return force_N >= constant_noises * noise_N && line.risen_W.norm() <= constant_share * force_N &&
         now.v_W.norm() >= speed_gain * s.first_speed_m_per_s;
}

}  // namespace proxarm::controller
