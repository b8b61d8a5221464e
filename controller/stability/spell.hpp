// Decides whether an oscillation lasts, because the loop is unstable with this hand, or dies away, like a blow's.
//
// A spell is an oscillation, pauses up to pause_s included: a wall interrupts it in every period. Its size is ⟨x̃²⟩,
// half of the amplitude squared (passivity.hpp). It lasts if it has gone on for lasting_s and ⟨x̃²⟩ is at least half of
// its largest value within the last 1.25 s (five times pause_s). A half, because the average ripples by a fifth at 4 Hz
// and limit cycles at walls vary.
//
// A longer memory would miss an unstable loop that after a jerk settles below half of the jerk's size. A shorter one
// would count decaying oscillations: with the amplitude's time constant τ_a, ⟨x̃²⟩ falls to a half in τ_a/2.9 and to
// nine tenths in τ_a/19. A swing below nine tenths of the largest must have gone on for decaying_s. The average takes
// some 0.25 s to rise; in the remaining 0.85 s all with τ_a < 2.4 s have halved. A swing above nine tenths after
// lasting_s has a τ_a of 4 s or more.
//
// If ⟨x̃²⟩ falls to a sixteenth, the spell is over, and a new one begins. Below the amplitude felt_m, a spell must go
// on for small_lasting_s. A tool that turns, and a swing below nine tenths, must also have swung lasting_periods: after
// a jerk, a hand of 20 Nm/rad on 0.05 kg m² swings at 3 to 4.5 Hz for about five periods.
#pragma once

#include <array>

#include "models/base/state_archive.hpp"

namespace proxarm::controller {

struct SpellConfig {
  // A blow oscillates for 0.1 to 0.3 s. Gears ring for up to 1.4 s after it, with decreasing amplitude.
  double lasting_s = 0.5, small_lasting_s = 3.0, felt_m = 0.5e-3;
  double decaying_s = 1.1;
  double lasting_periods = 4.0;
  double pause_s = 0.25;
};

struct SeenSwing {
  bool oscillates = false;
  double square_m2 = 0.0;               // ⟨x̃²⟩
  double speed_square_m2_per_s2 = 0.0;  // ⟨ẋ̃²⟩
  bool turns = false;                   // position and rotation together
};

class Spell {
 public:
  explicit Spell(const SpellConfig& config) : config_(config) {}
  void start() noexcept;
  void step(const SeenSwing& now, double period_s) noexcept;
  // After the last step.
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
