#include "controller/handle/force_jump.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/handle/hand_force.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;
using models::Wrench;

// Multiple of σ allowed to the noise of the difference between a sample and the average of about two samples before it.
// This difference has a variance of some 2.3 σ². It exceeds 8 σ once in 1e7 samples of an axis, and never in several
// successive samples.
constexpr double noises = 8.0;
constexpr double least_noises = 20.0;
// trend_share averages the trend over some four samples. A force that jitters may equal the extrapolation by chance, so
// calm_kept makes a force count as calm only after some ten calm samples.
constexpr double trend_share = 0.25, calm_kept = 0.8;
constexpr double flipped_share = 0.02, least_flip_N = 1.0, least_turn_N = 10.0;
// A hand's force that has flipped must grow by this factor within this time, in a cone of 17 degrees (beside_share).
constexpr double grown = 2.5, beside_share = 0.3, grows_within_s = 1.0;
// A change is a step if the force then stays for kept_s, to within this share of the change. A blow of steel ends
// within milliseconds. A force that returns to its value of up to back_s before is no step.
constexpr double kept_share = 0.2, kept_s = 0.005, back_s = 0.05;
// A sample that comes after more than this many usual intervals begins a new sequence of samples.
constexpr double late = 1.5;

Vec3 turned_about_zero(const Vec3& sign, const Vec3& load, const Vec3& zero) {
  return sign.cwiseProduct(load + zero) - zero;
}

}  // namespace

// Whether the sample equals the turned load, to 2 % of the step and the noise.
bool ForceJump::is_turned(const LoadSample& sample, const Wrench& turned_S, double step_N,
                          double step_Nm) const noexcept {
  const double off_N = (sample.load_S.force - turned_S.force).norm();
  const double off_Nm = (sample.load_S.torque - turned_S.torque).norm();
  const double zero_Nm = 2.0 * config_.handle_S.norm() * sample.beside_zero_S.norm();
  return off_N <= flipped_share * step_N + noises * sample.noise_N &&
         off_Nm <= flipped_share * step_Nm + noises * noise_lever_m * sample.noise_N + zero_Nm;
}

// Whether the load equals the extrapolated load with the signs of all three axes or of two axes reversed. A force that
// swings through zero also becomes its own opposite between two samples, but the extrapolation then expects this
// opposite. A flip of less than the limit only begins the watch for a flip that grows.
bool ForceJump::flipped(const LoadSample& sample, const Wrench& expected_S, double off_N) noexcept {
  State& s = state_;
  const double noise_N = least_noises * sample.noise_N;
  if (s.samples < 2.0 || off_N < 0.5 * std::max(least_flip_N, noise_N) || s.calm_N > kept_share * off_N) return false;
  const Vec3 weight_S = sample.load_S.force - sample.hand_S;
  const std::array<Vec3, 4> signs{Vec3(-1, -1, -1), Vec3(-1, -1, 1), Vec3(-1, 1, -1), Vec3(1, -1, -1)};
  for (const Vec3& sign : signs) {
    for (const Vec3& zero_S : {Vec3(Vec3::Zero()), sample.beside_zero_S}) {
      const Wrench turned{turned_about_zero(sign, expected_S.force, zero_S), sign.cwiseProduct(expected_S.torque)};
      const double step_N = (turned.force - expected_S.force).norm();
      const double step_Nm = (turned.torque - expected_S.torque).norm();
      if (step_N < std::max(least_flip_N, noise_N) || s.calm_N > kept_share * step_N) continue;
      if (!is_turned(sample, turned, step_N, step_Nm)) continue;
      const double of_weight_N = (sign.cwiseProduct(weight_S) - weight_S).norm();
      const double least_N = of_weight_N >= least_flip_N || sign.sum() < -2.0 ? least_flip_N : least_turn_N;
      s.step_N = step_N;
      s.limit_N = std::max(least_N, noise_N);
      if (step_N >= s.limit_N) return true;
      s.turned_S = sample.hand_S;
      s.turned_s = 0.0;
      return false;
    }
  }
  return false;
}

// Whether the hand's force has grown along one line since the watched flip.
bool ForceJump::grows(const LoadSample& sample) noexcept {
  State& s = state_;
  if (s.turned_s < 0.0) return false;
  s.turned_s += sample.since_s;
  const double turned_N = s.turned_S.norm(), along_N = sample.hand_S.dot(s.turned_S) / turned_N;
  const double jumped_N = (sample.load_S.force - s.last_S.force).norm();
  const bool goes_on = s.turned_s <= grows_within_s && along_N >= 0.5 * turned_N &&
                       jumped_N <= kept_share * along_N + noises * sample.noise_N;
  if (!goes_on) s.turned_s = -1.0;
  const bool beside = (sample.hand_S - along_N / turned_N * s.turned_S).norm() > beside_share * along_N;
  if (!goes_on || beside || along_N < grown * turned_N) return false;
  s.step_N = 2.0 * turned_N;
  s.limit_N = std::max(least_flip_N, least_noises * sample.noise_N);
  return true;
}

// Whether the force has become small, or has returned to its value before the last step.
bool ForceJump::releases(const LoadSample& sample, double near_N) const noexcept {
  const bool back = state_.before_s <= back_s && (sample.load_S.force - state_.before_S).norm() <= near_N;
  return back || sample.hand_S.norm() <= near_N;
}

// Begins to watch this sample's change if it is large enough.
void ForceJump::watch(const LoadSample& sample, const Wrench& expected_S, double off_N) noexcept {
  State& s = state_;
  const double usual_ms = 1e3 * std::max(sample.usual_s, sample.since_s);
  const double most_N = config_.max_step_N * std::max(1.0, usual_ms) + noises * sample.noise_N;
  const double least_N = std::max(config_.least_N, least_noises * sample.noise_N);
  const double step_N = (sample.load_S.force - s.last_S.force).norm();
  const Vec3 off = sample.load_S.force - expected_S.force;
  const Vec3 off_torque = sample.load_S.torque - expected_S.torque - config_.handle_S.cross(off);
  const double beside_Nm = beside_handle_m * off_N + noises * noise_lever_m * sample.noise_N;
  const bool calm = s.samples >= 2.0 && s.calm_N <= kept_share * off_N;
  const bool offset = off_N >= least_N && calm && off_torque.norm() > beside_Nm;
  if (!std::isfinite(off_N) || (step_N < most_N && !offset)) return;
  if (releases(sample, kept_share * off_N + noises * sample.noise_N)) return;
  s.before_S = s.last_S.force;
  s.before_s = 0.0;
  s.stepped_S = sample.load_S.force;
  s.stepped_trend_S = calm ? s.trend_S.force : Vec3(Vec3::Zero());
  s.step_N = off_N;
  s.limit_N = step_N >= most_N ? most_N : least_N;
  s.watched_s = 0.0;
}

bool ForceJump::stayed(const LoadSample& sample) noexcept {
  State& s = state_;
  if (s.watched_s < 0.0) return false;
  s.watched_s += sample.since_s;
  s.stepped_S += s.stepped_trend_S;
  const double changed_N = (sample.load_S.force - s.stepped_S).norm();
  if (!(changed_N <= kept_share * s.step_N + noises * sample.noise_N)) {
    s.watched_s = -1.0;
    return false;
  }
  return s.watched_s >= kept_s;
}

bool ForceJump::step(const LoadSample& sample) noexcept {
  State& s = state_;
  if (!(sample.since_s <= late * sample.usual_s)) s.samples = 0.0;
  if (s.samples == 0.0) {
    s = {.last_S = sample.load_S, .trend_S = {}, .samples = 1.0};
    return false;
  }
  const Wrench expected_S{s.last_S.force + s.trend_S.force, s.last_S.torque + s.trend_S.torque};
  const double off_N = (sample.load_S.force - expected_S.force).norm();
  s.before_s += sample.since_s;
  const bool found = grows(sample) || flipped(sample, expected_S, off_N) || stayed(sample);
  if (!found) watch(sample, expected_S, off_N);
  s.trend_S.force += trend_share * (sample.load_S.force - expected_S.force);
  s.trend_S.torque += trend_share * (sample.load_S.torque - expected_S.torque);
  s.calm_N = std::max(off_N, calm_kept * s.calm_N);
  s.samples = 2.0;
  s.last_S = sample.load_S;
  return found;
}

}  // namespace proxarm::controller
