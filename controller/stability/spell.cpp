#include "controller/stability/spell.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace proxarm::controller {
namespace {

// Shares of the largest remembered ⟨x̃²⟩. Above steady_share, the oscillation is steady. Between steady_share and
// kept_share, the oscillation may decay, and must go on for decaying_s and lasting_periods. Below kept_share, the
// oscillation doesn't last. Below died_away, it is over.
constexpr double steady_share = 0.9, kept_share = 0.5, died_away = 1.0 / 16.0;

}  // namespace

void Spell::start() noexcept {
  lasted_s_ = pause_s_ = in_slot_s_ = 0.0;
  largest_.fill(0.0);
  lasts_ = false;
}

void Spell::step(const SeenSwing& now, double period_s) noexcept {
  lasts_ = false;
  const double pause_s = now.oscillates ? 0.0 : pause_s_ + period_s;
  if (pause_s > config_.pause_s) start();
  pause_s_ = pause_s;
  if (!now.oscillates && !(lasted_s_ > 0.0)) return;
  remember(now.square_m2, period_s);
  const double most = *std::max_element(largest_.begin(), largest_.end());
  if (now.square_m2 < died_away * most) return start();
  lasted_s_ += period_s;
  lasts_ = lasting(now, most);
}

void Spell::remember(double square_m2, double period_s) noexcept {
  in_slot_s_ += period_s;
  if (in_slot_s_ > config_.pause_s) {
    std::rotate(largest_.begin(), largest_.end() - 1, largest_.end());
    largest_.front() = 0.0;
    in_slot_s_ = period_s;
  }
  largest_.front() = std::max(largest_.front(), square_m2);
}

bool Spell::lasting(const SeenSwing& now, double most) const noexcept {
  if (!now.oscillates || lasted_s_ < config_.lasting_s || now.square_m2 < kept_share * most) return false;
  const bool may_decay = now.square_m2 < steady_share * most;
  if (may_decay && lasted_s_ < config_.decaying_s) return false;
  if (now.turns || may_decay) {
    const double periods = lasted_s_ / (2.0 * std::numbers::pi) * std::sqrt(now.speed_square_m2_per_s2 / now.square_m2);
    if (!(periods >= config_.lasting_periods)) return false;
  }
  return 2.0 * now.square_m2 >= config_.felt_m * config_.felt_m || lasted_s_ >= config_.small_lasting_s;
}

}  // namespace proxarm::controller
