// Detects a stuck channel of a force sensor: it repeats one reading while other channels change.
//
// The first 200 samples, read while the arm stands, decide which channels can be judged. With x a channel's reading in
// counts, half the mean square of x(k) − x(k−1) is the variance of its noise, whatever its drift. From half a count
// squared on, the noise before rounding has a standard deviation of at least 0.5 counts (rounding adds 1/12; the
// estimate is right to 50 % at five sigmas). A sample then repeats the last one with a probability of at most 0.52, and
// a hundred in a row with 0.52¹⁰⁰ = 4e-29: never, in six channels at 1 kHz for a century (2e13 samples). A quieter
// channel isn't judged. Samples that repeat in all channels don't count; ForceSample::repeats counts them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "models/base/archive_fields.hpp"

namespace proxarm::fieldbus {

class ChannelWatch {
 public:
  static constexpr std::uint32_t most_repeats = 100;

  // Adds a sample, in counts; at most six channels.
  void add(std::span<const double> counts) noexcept {
    State& s = state_;
    const std::size_t n = counts.size() < s.last.size() ? counts.size() : s.last.size();
    bool changed = false;
    for (std::size_t i = 0; i < n; ++i) changed = changed || counts[i] != s.last[i];
    if (!changed) return;
    for (std::size_t i = 0; i < n; ++i) {
      const double step = counts[i] - s.last[i];
      s.repeats[i] = step == 0.0 ? s.repeats[i] + 1.0 : 0.0;
      if (s.learned > 0.0 && s.learned <= learning) s.squares[i] += step * step;
      s.last[i] = counts[i];
    }
    if (s.learned <= learning) s.learned += 1.0;
  }

  // How often the longest stuck channel, of those that can be judged, has repeated its reading.
  [[nodiscard]] std::uint32_t repeats() const noexcept {
    if (state_.learned <= learning) return 0;
    double most = 0.0;
    for (std::size_t i = 0; i < state_.last.size(); ++i) {
      if (state_.squares[i] >= 2.0 * learning * least_variance && state_.repeats[i] > most) most = state_.repeats[i];
    }
    return static_cast<std::uint32_t>(most);
  }

  void archive(StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  static constexpr double learning = 200.0, least_variance = 0.5;

  struct State {
    std::array<double, 6> last{};
    std::array<double, 6> repeats{};
    std::array<double, 6> squares{};  // sums of squared steps between samples
    double learned = 0.0;             // samples so far
  };
  State state_;
};

}  // namespace proxarm::fieldbus
