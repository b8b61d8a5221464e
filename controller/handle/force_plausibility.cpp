#include "controller/handle/force_plausibility.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;

// The proxy rests below this speed; a hand that holds still trembles as fast. No force leads it below this one.
constexpr double at_rest_m_per_s = 2e-3, no_force_N = 0.5;
// A hundred times the noise of a usual sensor: smaller forces say little.
constexpr double least_force_N = 3.0, least_growth = 2.0, least_way_m = 6e-3, least_samples = 20.0;
constexpr double explained = 0.97;

// For the straight line:
constexpr double near_m = 1e-3, far_m = 1e-2;
// The line is tested every 30 samples. If it were tested at each one, chance would reject a good line now and then.
constexpr double looks = 30.0, bend_noises = 3.0;
// For the jump. The share of a fifth allows for the tool behind the sensor, which oscillates as the arm starts.
constexpr double jump_s = 0.03, jump_share = 0.2, jump_noises = 20.0;
constexpr double ramp_noises = 30.0, constant_noises = 10.0, constant_share = 0.15, speed_gain = 1.5;

}  // namespace

// Whether the force's part along a direction is a straight line in the distance's, to its share of the variance. With
// NaN it is none.
bool ReversedForce::is_line(const Vec3& along) const noexcept {
  const State& s = state_;
  const double x = along.dot(s.x), h = along.dot(s.h);
  const double xx = along.dot(s.xx * along) - x * x / s.n, hh = along.dot(s.hh * along) - h * h / s.n;
  const double xh = along.dot(s.xh * along) - x * h / s.n;
  return xh > 0.0 && xh * xh >= explained * xx * hh;
}

bool ReversedForce::step(const ForceAndMotion& now) noexcept {
  State& s = state_;
  const Vec3 net_W = now.mass_kg / now.period_s * (now.v_W - s.v_k1_W);
  const bool rests = now.v_W.norm() < at_rest_m_per_s;
  if (rests || net_W.norm() < no_force_N || net_W.dot(now.v_W) <= 0.0) {
    s = {};
    s.rest_W = now.q_W;
    if (!rests) s.v_rest_W = now.v_W;
    s.first_N = net_W.norm();
    s.judged = true;
  }
  s.v_k1_W = now.v_W;
  s.judged = s.judged && now.free && !now.limited;
  if (!s.judged) return false;
  s.rest_W += now.period_s * s.v_rest_W;
  const Vec3 x = now.q_W - s.rest_W;
  s.n += 1.0;
  s.x += x;
  s.h += net_W;
  s.xx += x * x.transpose();
  s.hh += net_W * net_W.transpose();
  s.xh += x * net_W.transpose();
  const double net_N = net_W.norm(), least_N = std::max(least_force_N, least_growth * s.first_N);
  if (s.n < least_samples || net_N < least_N) return false;
  const Vec3 along = net_W / net_N;
  return x.dot(along) >= least_way_m && is_line(along);
}

void StraightForce::add(const ForceAndMotion& now) noexcept {
  if (state_.fit.n == 0.0) state_.first_speed_m_per_s = now.v_W.norm();
  state_.fit.add(now.force_W, now.period_s);
}

// Whether the force is still, to within a fifth, what it was 30 ms after the handle was empty.
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
  // While the handle is empty, the bias is followed, which bends the line.
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
