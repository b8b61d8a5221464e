// Whether an oscillation lasts: the loop isn't stable with this hand, and it is no blow that rings and dies away.
//
// A spell is an oscillation, pauses up to pause_s included: a wall interrupts it in every period. Its size is ⟨x̃²⟩,
// half of the amplitude squared (passivity.hpp). It lasts if it has gone on for lasting_s and doesn't decay: ⟨x̃²⟩ is at
// least kept = ½ of its largest value within the last five quarters of a second (five times pause_s). A half, because
// the average ripples by a fifth at 4 Hz and limit cycles at walls vary.
//
// No longer than five quarters, because after a jerk an unstable loop may settle at less than a half of what the jerk
// made. It is told once the jerk is out of the memory, 1 to 1.25 s later. And no shorter, because of what decays. An
// amplitude that falls by e in τ_a lets ⟨x̃²⟩ fall to a half in τ_a/2.9 and to nine tenths in τ_a/19; the average takes
// some 0.25 s to rise, and ripples. So a swing that is below nine tenths of the largest must have gone on for
// decaying_s: then, in 0.85 s, all with τ_a < 2.4 s have halved; and what is above nine tenths after lasting_s has a τ_a
// of 4 s or more. An exponential memory that tells as soon, of 0.75 s, would take what decays with τ_a = 0.8 s for
// lasting.
//
// If ⟨x̃²⟩ falls to a sixteenth, the spell is over. What is left is a new one, which has to last by itself. Below the
// amplitude felt_m, it must go on for small_lasting_s. A tool that turns, and a swing below nine tenths, must also have
// swung lasting_periods. After a jerk a hand of 20 Nm/rad on 0.05 kg m² swings at 3 to 4.5 Hz, and so do 4 kg on a
// layer of 2.5 kN/m. 0.5 s are two of these periods, and the swing dies away in the next three.
#pragma once

#include <array>

#include "models/base/state_archive.hpp"

namespace proxarm::controller {

struct SpellConfig {
  // A blow oscillates for 0.1 to 0.3 s. Gears ring for up to 1.4 s after it, with a decreasing amplitude.
  double lasting_s = 0.5, small_lasting_s = 3.0, felt_m = 0.5e-3;
  double decaying_s = 1.1;
  double lasting_periods = 4.0;
  double pause_s = 0.25;
};

// What is known of the swing in a cycle.
struct SeenSwing {
  bool oscillates = false;
  double square_m2 = 0.0;               // ⟨x̃²⟩
  double speed_square_m2_per_s2 = 0.0;  // ⟨ẋ̃²⟩
  bool turns = false;                   // place and rotation together
};

class Spell {
 public:
  explicit Spell(const SpellConfig& config) : config_(config) {}
  void start() noexcept;
  void step(const SeenSwing& now, double period_s) noexcept;
  // Of the last step.
  [[nodiscard]] bool lasts() const noexcept { return lasts_; }
  void archive(fieldbus::StateArchive& state) noexcept { state(lasted_s_, pause_s_, in_slot_s_, largest_, lasts_); }

 private:
  void remember(double square_m2, double period_s) noexcept;
  [[nodiscard]] bool lasting(const SeenSwing& now, double most) const noexcept;

  SpellConfig config_;
  double lasted_s_ = 0.0;
  double pause_s_ = 0.0;             // since the last oscillation
  double in_slot_s_ = 0.0;           // time in the newest slot of the memory, up to pause_s
  std::array<double, 5> largest_{};  // ⟨x̃²⟩ in each slot, the newest first, m²
  bool lasts_ = false;
};

}  // namespace proxarm::controller
