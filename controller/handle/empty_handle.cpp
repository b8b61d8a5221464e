#include "controller/handle/empty_handle.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double filter_s = 0.015;
// Multiples of σ_f (noise) and of σ/√n (tare) in the noise band. One of three axes exceeds 8 σ_f once in 1e15 samples.
constexpr double noise_deviations = 8.0, tare_deviations = 4.0;
// The handle counts as empty when the force has stayed within a band for the time in which the proxy, at its speed,
// covers this distance: at least the shortest time of the band, at most longest_s. Calm: the noise band. Quiet: the
// wider band.
constexpr double calm_way_m = 0.02, shortest_calm_s = 0.06;
constexpr double quiet_way_m = 0.04, shortest_quiet_s = 0.5;
constexpr double longest_s = 1.5;
// Largest distance by which the uncertainty of the tare may move the proxy from rest before the handle counts as empty.
constexpr double unknown_way_m = 1.7e-3;
constexpr double leaving = 1.5;
// After an acceleration the arm's first mode (15 Hz) may make the handle oscillate for two periods.
constexpr double ringing_s = 0.1;
// The braking force rises within 0.05 s. A hand that wrongly counts as absent thus feels a pull, not a jerk.
constexpr double braking_rise_m_per_s3 = 80.0, braking_s = 0.07;
// Share of the force that led the handle. While the arm brakes, the oscillating tool behind the sensor may add this
// share to the force.
constexpr double led_share = 0.2;
// While the handle is empty, bias_W follows the force that led the handle with this time constant, at most at this
// rate.
constexpr double followed_s = 0.1, followed_N_per_s = 2.0;
// The arm no longer moves when the proxy's speed has been below 0.1 mm/s for half a second.
constexpr double rest_m_per_s = 1e-4, rest_time_s = 0.5;

}  // namespace

EmptyHandle::EmptyHandle(const EmptyHandleConfig& config, double period_s) noexcept
    : config_(config), period_s_(period_s) {}

void EmptyHandle::set_period(double period_s) noexcept { period_s_ = period_s; }

// Returns the size of the hand's wrench less the force that led the handle. The lever lever_m converts the torque to a
// force.
double EmptyHandle::size_N(const models::Wrench& wrench_W) const noexcept {
  const double force_N = (wrench_W.force - state_.bias_W).norm();
  if (!(config_.lever_m > 0.0)) return force_N;
  return std::max(force_N, wrench_W.torque.norm() / config_.lever_m);
}

// Lets bias_W follow the sensor's bias that led the handle, since the sensor's bias may keep drifting. When the handle
// rests, Measurement::follow_bias() takes the sensor's bias out of the readings.
void EmptyHandle::follow() noexcept {
  State& s = state_;
  if (!s.led) return;
  const Vec3 behind_W = s.wrench_W.force - s.bias_W;
  const double most_N =
      std::min(period_s_ / followed_s, followed_N_per_s * period_s_ / std::max(1e-9, behind_W.norm()));
  s.bias_W += std::min(1.0, most_N) * behind_W;
}

// Returns the longest time within a band before the handle counts as empty. Reason for this bound: the uncertainty of
// the tare, unknown_N, moves the proxy while the handle counts as held. A noisy sensor has a large uncertainty.
double EmptyHandle::longest_empty_s(const HandSigns& signs, double unknown_N) noexcept {
  if (!(signs.mass_kg > 0.0 && unknown_N > 0.0)) return longest_s;
  return std::clamp(std::sqrt(2.0 * unknown_way_m * signs.mass_kg / unknown_N), shortest_quiet_s, longest_s);
}

bool EmptyHandle::step(const HandSigns& signs) noexcept {
  const double T = period_s_, share = T / (T + filter_s);
  State& s = state_;
  s.wrench_W.force += share * (signs.hand_W.force - s.wrench_W.force);
  s.wrench_W.torque += share * (signs.hand_W.torque - s.wrench_W.torque);
  const double speed = signs.v_W.norm();
  s.acceleration_m_per_s2 =
      std::max((1.0 - T / (T + ringing_s)) * s.acceleration_m_per_s2, (signs.v_W - s.v_k1_W).norm() / T);
  s.v_k1_W = signs.v_W;

  const double sigma_f = signs.noise_N * std::sqrt(std::min(1.0, signs.sample_cycles * T / (2.0 * filter_s)));
  const double sigma_mean = signs.tare_samples > 0.0 ? signs.noise_N / std::sqrt(signs.tare_samples) : 0.0;
  double noise_band = noise_deviations * sigma_f + tare_deviations * sigma_mean;
  // If the noise isn't white, a hand moved the handle during the tare or the sensor filters its samples. How much of σ
  // is noise is then unknown.
  if (!signs.noise_is_white) noise_band = std::min(noise_band, config_.band_N);
  const double band = std::max(config_.band_N, noise_band) + signs.unknown_N;
  noise_band += signs.unknown_N;
  follow();
  const double size = size_N(s.wrench_W);
  s.calm_s = size <= noise_band ? s.calm_s + T : 0.0;
  s.quiet_s = size <= band ? s.quiet_s + T : 0.0;
  if (s.empty) {
    const double held_N =
        leaving * band + leaving * config_.tool_mass_kg * s.acceleration_m_per_s2 + led_share * s.bias_W.norm();
    s.empty = size <= held_N && (!config_.at_once || size_N(signs.hand_W) <= held_N + noise_deviations * signs.noise_N);
    if (!s.empty) {
      s.calm_s = s.quiet_s = 0.0;
      s.led = false;
      s.bias_W.setZero();
      way_.start();
    }
  } else {
    if (signs.at_handle) way_.start();
    s.led = way_.step({signs.hand_W.force, signs.v_W, signs.mass_kg, signs.noise_N, T, signs.left_by_tare,
                       signs.as_offset, signs.limited});
    if (s.led) s.bias_W = way_.line_W();
    const double ways = config_.way_share / speed;
    const double longest = longest_empty_s(signs, tare_deviations * sigma_mean);
    s.empty = s.led || s.calm_s >= std::clamp(calm_way_m * ways, shortest_calm_s, longest) ||
              s.quiet_s >= std::clamp(quiet_way_m * ways, shortest_quiet_s, longest);
  }
  s.braking_m_per_s2 = s.empty ? std::min(braking_m_per_s2, s.braking_m_per_s2 + braking_rise_m_per_s3 * T) : 0.0;
  s.rest_s = s.empty && speed <= rest_m_per_s ? s.rest_s + T : 0.0;
  return s.empty;
}

bool EmptyHandle::rests() const noexcept { return state_.rest_s >= rest_time_s; }

Vec3 EmptyHandle::braking_force_W(double mass_kg, const Vec3& v_W) const noexcept {
  const double wanted = v_W.norm() / braking_s;
  const double share = wanted > state_.braking_m_per_s2 ? state_.braking_m_per_s2 / wanted : 1.0;
  return -mass_kg * share / braking_s * v_W;
}

}  // namespace proxarm::controller
