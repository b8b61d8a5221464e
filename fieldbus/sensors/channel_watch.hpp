// Detects a stuck channel of a force sensor: a channel that repeats one reading while other channels change.
//
// How a channel is judged (x(k) is its reading in sample k, in counts):
// 1. The first 200 samples are read while the arm stands. They give an estimate of the variance of the channel's noise:
//    half the mean square of x(k) − x(k−1). A drift of the channel doesn't affect this estimate.
// 2. A channel is judged only if the estimate is at least 0.5 counts². Rounding contributes 1/12 counts² to it, and the
//    estimate is accurate to 50 % (five standard deviations). So the noise before rounding has a standard deviation of
//    at least 0.5 counts.
// 3. With this noise, a sample repeats the reading of the sample before with a probability of at most 0.52.
// 4. A hundred repetitions in a row have a probability of 0.52¹⁰⁰ = 4e-29. Six channels at 1 kHz give 2e13 samples in a
//    century, so a working channel never repeats a reading a hundred times.
// A channel with less noise isn't judged. A sample in which no channel has changed doesn't count here;
// ForceSample::repeats counts such samples.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "models/base/archive_fields.hpp"

namespace proxarm::fieldbus {

class ChannelWatch {
 public:
  static constexpr std::uint32_t most_repeats = 100;

  // Adds a sample. Unit of `counts`: counts of each channel; at most six channels are used.
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

  // Returns how often the channel that has been stuck longest has repeated its reading. Only channels that can be
  // judged are considered.
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
    std::array<double, 6> squares{};  // sums of the squared differences between consecutive samples
    double learned = 0.0;             // number of samples so far
  };
  State state_;
};

}  // namespace proxarm::fieldbus
