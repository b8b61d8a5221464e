// Decides whether an oscillation lasts because the loop is unstable with this hand, or dies away, as after a blow.
//
// A spell is an oscillation including its pauses of up to pause_s, since a wall interrupts an oscillation in every
// period. The spell's size is ⟨x̃²⟩, half of the amplitude squared (passivity.hpp). The spell lasts if it has gone on
// for lasting_s and ⟨x̃²⟩ is at least half of its largest value within the last 1.25 s (five times pause_s). The
// threshold is a half because the average ripples by a fifth at 4 Hz, and because limit cycles at walls vary in size.
//
// A memory longer than 1.25 s would miss an unstable loop that swings less than half as much as the jerk that started
// it. A memory shorter than 1.25 s would count decaying oscillations as lasting.
//
// How long a spell must go on depends on its decay. Let the amplitude decay with the time constant τ_a:
// 1. ⟨x̃²⟩ falls to a half in τ_a/2.9, and to nine tenths in τ_a/19.
// 2. The average takes some 0.25 s to rise. This leaves 0.85 s of decaying_s, in which ⟨x̃²⟩ falls below a half if τ_a
//    < 2.4 s. So a spell below nine tenths of its largest ⟨x̃²⟩ must go on for decaying_s.
// 3. A spell that is above nine tenths after lasting_s has a τ_a of 4 s or more. So lasting_s suffices for it.
//
// If ⟨x̃²⟩ falls to a sixteenth of its largest value, the spell is over, and a new spell begins. Below the amplitude
// felt_m, a spell must go on for small_lasting_s. If the tool turns, or if ⟨x̃²⟩ is below nine tenths of its largest
// value, the spell must also have lasted for lasting_periods: after a jerk, a hand of 20 Nm/rad on 0.05 kg m² swings at
// 3 to 4.5 Hz for about five periods.
#pragma once

#include <array>

#include "models/base/state_archive.hpp"

namespace proxarm::controller {

struct SpellConfig {
  // A blow counts as an oscillation for 0.1 to 0.3 s. The gears ring for up to 1.4 s after the blow, with decreasing
  // amplitude.
  double lasting_s = 0.5, small_lasting_s = 3.0, felt_m = 0.5e-3;
  double decaying_s = 1.1;
  double lasting_periods = 4.0;
  double pause_s = 0.25;
};

struct SeenSwing {
  bool oscillates = false;
  double square_m2 = 0.0;               // ⟨x̃²⟩
  double speed_square_m2_per_s2 = 0.0;  // ⟨ẋ̃²⟩
  bool turns = false;                   // ⟨x̃²⟩ and ⟨ẋ̃²⟩ include the rotation
};

class Spell {
 public:
  explicit Spell(const SpellConfig& config) : config_(config) {}
  void start() noexcept;
  void step(const SeenSwing& now, double period_s) noexcept;
  // Whether the oscillation lasted in the last step().
  [[nodiscard]] bool lasts() const noexcept { return lasts_; }
  void archive(fieldbus::StateArchive& state) noexcept { state(lasted_s_, pause_s_, in_slot_s_, largest_, lasts_); }

 private:
  void remember(double square_m2, double period_s) noexcept;
  [[nodiscard]] bool lasting(const SeenSwing& now, double most) const noexcept;

  SpellConfig config_;
  double lasted_s_ = 0.0;
  double pause_s_ = 0.0;             // time since the last oscillating step
  double in_slot_s_ = 0.0;           // time in the newest slot of the memory, up to pause_s
  std::array<double, 5> largest_{};  // largest ⟨x̃²⟩ in each slot, the newest slot first, m²
  bool lasts_ = false;
};

}  // namespace proxarm::controller
