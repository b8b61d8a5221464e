// How the handle vibrates: amplitude by frequency, in third-octave bands from 10 to 400 Hz.
//
// The bands are those of IEC 61260-1 (base ten): centres 10^(n/10) Hz, n = 10 … 26, edges 10^(±1/20) of them. A band
// has the amplitude of the sine that vibrates as strongly as all that is in it, so a sine has its own amplitude
// wherever in the band it is, and noise doesn't depend on how long it is listened to:
//   A² = Σ |2 X(f)/Σw|² / 1.5   over the band's lines and the three axes
// X is the Fourier transform of the place over the last second with Hann's window w, whose noise bandwidth is 1.5
// lines (Harris, Proceedings of the IEEE 66, 1978). It is taken of the second difference of places and divided by that
// difference's own transfer, 2 (1 − cos ωT): where a hand leads the tool by hundreds of millimetres a second the window
// alone would smear that over the bands. A motion along a circle of radius r counts √2 r.
// Bands that reach beyond half the rate of the cycle are left out. Allocates; not for the cycle.
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
    double frequency_Hz = 0.0;  // of what is in it: the mean of its lines, weighted by the power of the acceleration
  };

  // The next place of the handle. Places that don't follow each other by one period begin anew.
  void add(double time_s, double period_s, const models::Vec3& place_m);
  // The next cycle: of rendering its tool, where it truly is where that is known, else by the encoders.
  void add(const CycleRecord& record);
  void reset() noexcept { places_.clear(); }

  // Of the last second; empty before there is one.
  [[nodiscard]] std::vector<Band> bands() const;

 private:
  [[nodiscard]] std::size_t samples() const noexcept;
  [[nodiscard]] std::vector<models::Vec3> windowed_differences() const;

  double period_s_ = 0.0, last_s_ = 0.0;
  std::vector<models::Vec3> places_;  // at most twice as many as the window has
};

}  // namespace proxarm::controller
