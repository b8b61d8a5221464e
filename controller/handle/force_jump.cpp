#include "controller/handle/force_jump.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/handle/hand_force.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;
using models::Wrench;

constexpr double noises = 8.0;  // of a difference of samples: once in 1e15
constexpr double least_noises = 20.0;
constexpr double flipped_share = 0.02, least_flip_N = 1.0, least_turn_N = 10.0;
// What stays within this share of the step for so long is one. A blow of steel is over within a few milliseconds.
constexpr double kept_share = 0.2, kept_s = 0.005, back_s = 0.05;
// A sample that is later than this many of the usual times isn't the next one.
constexpr double late = 1.5;

}  // namespace

// Whether the load is the one before with its sign, or the sign of two axes, turned. A force that swings through zero
// is its own opposite from one sample to the next, too, but it has come on the way there.
bool ForceJump::flipped(const LoadSample& sample) noexcept {
  State& s = state_;
  if (s.samples < 2.0) return false;
  const std::array<Vec3, 4> signs{Vec3(-1, -1, -1), Vec3(-1, -1, 1), Vec3(-1, 1, -1), Vec3(1, -1, -1)};
  for (const Vec3& sign : signs) {
    const Wrench turned{sign.cwiseProduct(s.last_S.force), sign.cwiseProduct(s.last_S.torque)};
    const double step_N = (turned.force - s.last_S.force).norm(), step_Nm = (turned.torque - s.last_S.torque).norm();
    const bool all = sign.sum() < -2.0;
    const double least_N = std::max(all ? least_flip_N : least_turn_N, least_noises * sample.noise_N);
    if (step_N < least_N || s.calm_N > kept_share * step_N) continue;
    const double off_N = (sample.load_S.force - turned.force).norm();
    const double off_Nm = (sample.load_S.torque - turned.torque).norm();
    if (!(off_N <= flipped_share * step_N + noises * sample.noise_N)) continue;
    if (!(off_Nm <= flipped_share * step_Nm + noises * noise_lever_m * sample.noise_N)) continue;
    s.step_N = step_N;
    s.limit_N = least_N;
    return true;
  }
  return false;
}

// Whether little force is left, or what was there before the last step.
bool ForceJump::releases(const LoadSample& sample, double near_N) const noexcept {
  const bool back = state_.before_s <= back_s && (sample.load_S.force - state_.before_S).norm() <= near_N;
  return back || sample.hand_S.norm() <= near_N;
}

// Whether this sample's step is one to watch.
void ForceJump::watch(const LoadSample& sample, double step_N) noexcept {
  State& s = state_;
  const double usual_ms = 1e3 * std::max(sample.usual_s, sample.since_s);
  const double most_N = config_.max_step_N * std::max(1.0, usual_ms) + noises * sample.noise_N;
  const double least_N = std::max(config_.least_N, least_noises * sample.noise_N);
  const Vec3 force = sample.load_S.force - s.last_S.force;
  const Wrench step{force, sample.load_S.torque - s.last_S.torque - config_.handle_S.cross(force)};
  const double beside_Nm = beside_handle_m * step_N + noises * noise_lever_m * sample.noise_N;
  const bool calm = s.samples >= 2.0 && s.calm_N <= kept_share * step_N;
  const bool offset = step_N >= least_N && calm && step.torque.norm() > beside_Nm;
  if (!std::isfinite(step_N) || (step_N < most_N && !offset)) return;
  if (releases(sample, kept_share * step_N + noises * sample.noise_N)) return;
  s.before_S = s.last_S.force;
  s.before_s = 0.0;
  s.stepped_S = sample.load_S;
  s.step_N = step_N;
  s.limit_N = step_N >= most_N ? most_N : least_N;
  s.watched_s = 0.0;
}

bool ForceJump::stayed(const LoadSample& sample) noexcept {
  State& s = state_;
  if (s.watched_s < 0.0) return false;
  s.watched_s += sample.since_s;
  const double changed_N = (sample.load_S.force - s.stepped_S.force).norm();
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
    s = {.last_S = sample.load_S, .stepped_S = {}, .samples = 1.0};
    return false;
  }
  const double step_N = (sample.load_S.force - s.last_S.force).norm();
  s.before_s += sample.since_s;
  const bool found = flipped(sample) || stayed(sample);
  if (!found) watch(sample, step_N);
  s.calm_N = step_N;
  s.samples = 2.0;
  s.last_S = sample.load_S;
  return found;
}

}  // namespace proxarm::controller
