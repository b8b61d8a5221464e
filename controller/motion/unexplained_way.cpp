#include "controller/motion/unexplained_way.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;

// Twice this, and what it takes to brake, are within the 5 cm that an arm may go with nobody at the handle.
constexpr double longest_way_m = 0.02;
// Looked at each time, a good line would be given up by chance now and then.
constexpr double looks = 10.0, deviations = 4.0;
// Of the force. A hand of 100 N/m changes by 2 N on the way allowed; the tool's swing is 6 % at first and dies out.
constexpr double share = 0.02;
// Of a sensor that says nothing of its noise.
constexpr double least_noise_N = 0.005;
constexpr double rest_m_per_s = 0.01, seen_s = 0.02;
constexpr double small_N = 1.5, same_share = 0.2, accelerated_share = 0.5, long_s = 1.0;

}  // namespace

void UnexplainedWay::add(const LedHandle& now) noexcept {
  State& s = state_;
  if (s.n == 0.0) {
    s.first_W = now.force_W;
    s.first_v_W = now.v_W;
    s.h = s.th = s.hh = s.way_W = Vec3::Zero();
    s.t = s.tt = 0.0;
  }
  const double t = s.n * now.period_s;
  const Vec3 h = now.force_W - s.first_W;
  s.n += 1.0;
  s.t += t;
  s.tt += t * t;
  s.h += h;
  s.th += t * h;
  s.hh += h.cwiseAbs2();
}

// Least squares, h = a + b t:  b = (n Σth − Σt Σh)/(n Σtt − (Σt)²),  a = (Σh − b Σt)/n,
// what is left: (Σhh − a Σh − b Σth)/(n − 2).
bool UnexplainedWay::bends(const LedHandle& now) noexcept {
  const State& s = state_;
  const Vec3 b = (s.n * s.th - s.t * s.h) / (s.n * s.tt - s.t * s.t);
  const Vec3 a = (s.h - b * s.t) / s.n;
  const Vec3 left = (s.hh - a.cwiseProduct(s.h) - b.cwiseProduct(s.th)) / (s.n - 2.0);
  risen_W_ = (s.n - 1.0) * now.period_s * b;
  line_W_ = s.first_W + a + risen_W_;
  const double noise_N = std::max(now.noise_N, least_noise_N), swing_N = share * line_W_.norm();
  return !(left.maxCoeff() <=
           noise_N * noise_N * (1.0 + deviations * std::sqrt(2.0 / (s.n - 2.0))) + swing_N * swing_N);
}

bool UnexplainedWay::leads(const LedHandle& now) const noexcept {
  const State& s = state_;
  const Vec3 mean_W = s.first_W + s.h / s.n;
  const double mean_N = mean_W.norm(), lasted_s = s.n * now.period_s;
  if (!(line_W_.dot(now.v_W) > 0.0) || !(now.mass_kg > 0.0)) return false;
  const double gained = now.mass_kg * (now.v_W - s.first_v_W).dot(mean_W) / mean_N;
  const bool accelerates = gained >= accelerated_share * mean_N * lasted_s;
  const double now_N = line_W_.norm();
  const bool from_rest = s.first_v_W.norm() <= rest_m_per_s + std::min(mean_N, now_N) / now.mass_kg * seen_s;
  if (from_rest && now_N < small_N) return true;
  const bool jumped = from_rest && risen_W_.norm() <= same_share * now_N;
  return accelerates && (jumped || lasted_s >= long_s);
}

bool UnexplainedWay::step(const LedHandle& now) noexcept {
  State& s = state_;
  add(now);
  s.way_W += now.period_s * now.v_W;
  const bool went = s.way_W.norm() >= longest_way_m;
  if (s.n < looks || std::fmod(s.n, looks) != 0.0) return false;
  if (!bends(now)) return went && leads(now);
  s.n = 0.0;
  return false;
}

}  // namespace proxarm::controller
