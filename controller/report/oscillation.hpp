// Finds the longest spell in which the arm swung by itself, with frequency and amplitude, for the summary's verdict.
//
// PassivityObserver (controller/stability/passivity.hpp) reports in each cycle whether the tool oscillates, and whether
// the oscillation lasts. Oscillating cycles form one spell if the pauses between them are at most `pause_s`, since a
// wall interrupts an oscillation in every period. A blow makes a spell of some 0.1 to 0.3 s; the gears' ringing after a
// blow makes a spell of up to 1.4 s.
//
// The tool's position passes through a high-pass H of n = 5 equal stages (fc = 4 Hz, which leaves 0.02 of a motion at 2
// Hz). z is the filtered position, ż its rate of change; ⟨z²⟩ and ⟨ż²⟩ are their mean squares over the spell. A
// sinusoid of amplitude A and frequency ω has
//   ω² = ⟨ż²⟩/⟨z²⟩,   A = √(2⟨z²⟩)/|H(ω)|,   |H| = (1 + (2πfc/ω)²)^(−n/2).
// For a tool that turns, ⟨z²⟩ and ⟨ż²⟩ combine position and rotation as in PassivityObserver: ⟨z² + ρ²ζ²⟩ with the
// filtered rotation ζ and ρ² = J/M. Position and rotation have an amplitude each, at the common ω. Vectors are in W.
// Not for the cycle.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct Oscillation {
  double from_s = 0.0;      // when the spell began, in the record's time
  double duration_s = 0.0;  // 0: no oscillation
  double frequency_Hz = 0.0;
  double amplitude_m = 0.0;  // amplitude of the tool's position
  // Amplitude of the tool's rotation; absent: the tool doesn't turn.
  std::optional<double> amplitude_rad;
  bool lasts = false;
};

class OscillationWatch {
 public:
  static constexpr double pause_s = 0.25;

  struct Cycle {
    bool oscillates = false, lasts = false;
    models::Vec3 tool_W = models::Vec3::Zero();
    // For a tool that turns: turned_W is the sum of its rotations so far, rad; gyration_m2 is ρ², m²/rad².
    bool turns = false;
    models::Vec3 turned_W = models::Vec3::Zero();
    double gyration_m2 = 0.0;
  };
  // Adds a cycle of rendering. Precondition: the cycle follows the last added one, or reset() was called in between.
  void add(double time_s, double period_s, const Cycle& cycle) noexcept;
  // Ends the present spell, because the next cycle doesn't follow the last one.
  void reset() noexcept;

  // The present spell.
  [[nodiscard]] Oscillation present() const noexcept;
  // The longest of the spells that last, or of all spells if none lasts.
  [[nodiscard]] Oscillation longest() const noexcept;

 private:
  struct Spell {
    double from_s = 0.0, until_s = 0.0;
    double z2 = 0.0, zdot2 = 0.0;          // sums of squares, position and rotation together
    double place2 = 0.0, rotation2 = 0.0;  // sums of squares, position and rotation separately
    double cycles = 0.0;                   // number of cycles in these sums
    bool turns = false, lasts = false;
    [[nodiscard]] double duration_s() const noexcept { return until_s - from_s; }
    [[nodiscard]] bool outdoes(const Spell& other) const noexcept;
    [[nodiscard]] Oscillation measured() const noexcept;
  };
  struct Stage {
    models::Vec3 x, z;  // input and output of the last cycle
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
