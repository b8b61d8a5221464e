#include "controller/motion/release.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;

// A remaining distance below this, one or two counts of an encoder, counts as zero.
constexpr double arrived_m = 1e-5;

SessionSettings plain(SessionSettings settings) {
  settings.damping_Ns_per_m = settings.spring_N_per_m = 0.0;
  settings.order = 1;
  settings.looks_ahead = false;
  return settings;
}

}  // namespace

Release::Release(const SessionSettings& settings, const OrientationConfig& orientation, double speed_m_per_s)
    : scene_(scenes::compile(scenes::Scene{})),
      tool_(make_rendered_world(scene_, plain(settings), mass_kg), orientation),
      period_s_(settings.period_s),
      speed_m_per_s_(speed_m_per_s) {}

void Release::start_back_off(const Vec3& start_W, const Vec3& n_W, double distance_m, const Vec3& force_W) noexcept {
  start_W_ = start_W;
  n_W_ = n_W;
  distance_m_ = std::clamp(distance_m, 2.0 * arrived_m, longest_back_off_m);
  against_N_ = std::max(0.0, -n_W.dot(force_W));
  pressed_N_ = 0.0;
}

void Release::start_yield(const Vec3& start_W, const Vec3& force_W) noexcept {
  start_back_off(start_W, force_W.normalized(), longest_yield_m, force_W);
  pressed_N_ = force_W.norm();
}

Vec3 Release::force_W(const Vec3& q_W, const Vec3& v_W, const Vec3& hand_W) const noexcept {
  const double M = mass_kg, b = damping_Ns_per_m, T = period_s_;
  Vec3 v = (v_W + T / M * hand_W) / (1.0 + b * T / M);
  if (backs_off()) {
    const double a = acceleration_m_per_s2, left = std::max(0.0, left_m(q_W));
    // At the speed left / T the motion arrives within this cycle.
    const double brake = std::min(std::sqrt(2.0 * a * left), left / T);
    v = std::min({speed_m_per_s_, n_W_.dot(v_W) + a * T, brake}) * n_W_;
  }
  return M / T * (v - v_W);
}

bool Release::over(const Vec3& q_W, const Vec3& hand_W) const noexcept {
  if (!backs_off()) return false;
  if (left_m(q_W) <= arrived_m || -n_W_.dot(hand_W) > against_N_ + resisted_N) return true;
  if (pressed_N_ == 0.0) return false;
  const double presses_N = n_W_.dot(hand_W);
  const bool tried = distance_m_ - left_m(q_W) > relief_way_m;
  return presses_N < yielded_N || (tried && presses_N > (1.0 - relief_share) * pressed_N_);
}

}  // namespace proxarm::controller
