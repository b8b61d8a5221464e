// Measures the handle's vibration: amplitude by frequency, in third-octave bands from 10 to 400 Hz.
//
// The bands are those of IEC 61260-1 (base ten): centres at 10^(n/10) Hz, n = 10 … 26; the edges are 10^(±1/20) times
// the centre. A band's amplitude is the amplitude of a sine with the band's power. So a sine anywhere in a band has its
// own amplitude, and the amplitude of noise doesn't depend on the length of the measurement:
//   A² = Σ |2 X(f)/Σw|² / 1.5   over the band's lines and the three axes
// X is the Fourier transform of the position over the last second with Hann's window w. The noise bandwidth of this
// window is 1.5 lines (Harris, Proceedings of the IEEE 66, 1978). X is computed from second differences, divided by
// their transfer function 2 (1 − cos ωT); with the window alone, a fast motion of the hand would smear over the bands.
// A motion along a circle of radius r counts as the amplitude √2 r. Bands beyond half the cycle's rate are left out.
// Allocates; not for the cycle.
#pragma once

#include <cstddef>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class HandleSpectrum {
 public:
  static constexpr double window_s = 1.0;

  struct Band {
    double centre_Hz = 0.0;
    double amplitude_m = 0.0;
    double frequency_Hz = 0.0;  // mean frequency of the band's lines, weighted by the acceleration's power
  };

  // Adds the handle's next position. If this position doesn't follow the last one by one period, the measurement begins
  // anew.
  void add(double time_s, double period_s, const models::Vec3& place_m);
  // Adds the tool's position in a rendering cycle: the true position if recorded, else the position by the encoders.
  void add(const CycleRecord& record);
  void reset() noexcept { places_.clear(); }

  // Returns the bands of the last second; empty before the first second is complete.
  [[nodiscard]] std::vector<Band> bands() const;

 private:
  [[nodiscard]] std::size_t samples() const noexcept;
  [[nodiscard]] std::vector<models::Vec3> windowed_differences() const;

  double period_s_ = 0.0, last_s_ = 0.0;
  std::vector<models::Vec3> places_;  // at most twice the window's samples
};

}  // namespace proxarm::controller
