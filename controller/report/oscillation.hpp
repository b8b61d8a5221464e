// Whether the arm swung by itself: the longest spell in which PassivityObserver found an oscillation, with its
// frequency and amplitude, for the verdict of the summary.
//
// The observer (controller/stability/passivity.hpp) says in each cycle whether the tool moves above the band of a
// hand's will and the device gives the hand energy there, and whether that lasts. Cycles that say so make a spell as
// long as pauses between them are shorter than `pause_s`: an oscillation that a wall stops in every period has such. A
// blow is a spell of some 0.1 to 0.3 s, an arm that rings after it one of up to 1.4 s; an unstable loop swings until
// something limits it.
//
// Position and velocity of the spell, behind a high-pass H of n = 5 equal stages (fc = 4 Hz, which leaves 0.02 of 2
// Hz), have the mean squares ⟨z²⟩ and ⟨ż²⟩; of a sinusoid of amplitude A and frequency ω
//   ω² = ⟨ż²⟩/⟨z²⟩,   A = √(2⟨z²⟩)/|H(ω)|,   |H| = (1 + (2πfc/ω)²)^(−n/2).
// Of a tool that turns, ⟨z²⟩ and ⟨ż²⟩ count place and rotation together, as PassivityObserver does: ⟨z² + ρ²ζ²⟩ with
// ρ² = J/M. Each has its own amplitude then, at the common ω.
// Vectors in W. Not for the cycle: whoever drains the records calls it.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct Oscillation {
  double from_s = 0.0;      // time of the record in which the spell began
  double duration_s = 0.0;  // 0: there was none
  double frequency_Hz = 0.0;
  double amplitude_m = 0.0;             // of the tool's place
  std::optional<double> amplitude_rad;  // of its rotation; none: it doesn't turn
  bool lasts = false;
};

class OscillationWatch {
 public:
  static constexpr double pause_s = 0.25;

  struct Cycle {
    bool oscillates = false, lasts = false;
    models::Vec3 tool_W = models::Vec3::Zero();
    // Of a tool that turns: the sum of its angles so far, rad, and ρ², m²/rad².
    bool turns = false;
    models::Vec3 turned_W = models::Vec3::Zero();
    double gyration_m2 = 0.0;
  };
  // A cycle of rendering; consecutive ones, or reset() between them.
  void add(double time_s, double period_s, const Cycle& cycle) noexcept;
  // The next cycle doesn't follow the last one.
  void reset() noexcept;

  // The spell that goes on now; and the longest of all that last, or of all if none does.
  [[nodiscard]] Oscillation present() const noexcept;
  [[nodiscard]] Oscillation longest() const noexcept;

 private:
  struct Spell {
    double from_s = 0.0, until_s = 0.0;
    double z2 = 0.0, zdot2 = 0.0;          // sums of the squares, place and rotation together,
    double place2 = 0.0, rotation2 = 0.0;  // and each for itself,
    double cycles = 0.0;                   // of so many
    bool turns = false, lasts = false;
    [[nodiscard]] double duration_s() const noexcept { return until_s - from_s; }
    [[nodiscard]] bool outdoes(const Spell& other) const noexcept;
    [[nodiscard]] Oscillation measured() const noexcept;
  };
  struct Stage {
    models::Vec3 x, z;  // what came in and went out in the cycle before
  };
  static constexpr std::size_t stage_count = 5;
  struct HighPass {
    std::array<Stage, stage_count> stages;  // set by the first cycle
    models::Vec3 z = models::Vec3::Zero(), zdot = models::Vec3::Zero();
    void step(double period_s, const models::Vec3& in, bool first) noexcept;
  };
  void end_spell() noexcept;

  bool filled_ = false;
  HighPass place_, rotation_;
  Spell present_, longest_;
};

}  // namespace proxarm::controller
