#include "controller/signals/handle_spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr int first_band = 10, last_band = 26;  // bands are at 10^(n/10) Hz, n from the first to the last
constexpr double hann_bandwidth = 1.5;          // noise bandwidth of Hann's window, in lines
constexpr double nearly = 0.01;                 // tolerance of the time between two positions, as a share of the period

double hann(std::size_t i, std::size_t samples) noexcept {
  return 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(samples));
}

// Returns Σ |X(f)|² over the axes. The phasor is rotated from sample to sample, which adds a rounding error of 1e-12 in
// a second.
double power(const std::vector<Vec3>& x, double radians_per_sample) noexcept {
  const std::complex<double> turn = std::polar(1.0, -radians_per_sample);
  std::complex<double> phasor = 1.0;
  Vec3 real = Vec3::Zero(), imaginary = Vec3::Zero();
  for (const Vec3& sample : x) {
    real += phasor.real() * sample;
    imaginary += phasor.imag() * sample;
    phasor *= turn;
  }
  return real.squaredNorm() + imaginary.squaredNorm();
}

}  // namespace

std::size_t HandleSpectrum::samples() const noexcept {
  return period_s_ > 0.0 ? static_cast<std::size_t>(std::lround(window_s / period_s_)) : 0;
}

void HandleSpectrum::add(double time_s, double period_s, const Vec3& place_m) {
  const bool follows = period_s == period_s_ && std::abs(time_s - last_s_ - period_s) < nearly * period_s;
  if (!follows) places_.clear();
  period_s_ = period_s;
  last_s_ = time_s;
  places_.push_back(place_m);
  const std::size_t kept = samples() + 2;
  if (places_.size() >= 2 * kept) places_.erase(places_.begin(), places_.end() - static_cast<std::ptrdiff_t>(kept));
}

void HandleSpectrum::add(const CycleRecord& record) {
  if (record.phase != Phase::rendering) return reset();
  const Triple& tool = record.has(RecordFlag::truth) ? record.true_tool_W_m : record.tool_W_m;
  add(1e-9 * static_cast<double>(record.time_ns), 1e-9 * static_cast<double>(record.period_ns), vec3(tool));
}

std::vector<Vec3> HandleSpectrum::windowed_differences() const {
  const std::size_t n = samples();
  const Vec3* const x = places_.data() + (places_.size() - n - 2);
  std::vector<Vec3> differences(n);
  Vec3 mean = Vec3::Zero();
  for (std::size_t i = 0; i < n; ++i) mean += differences[i] = (x[i + 2] - x[i + 1]) - (x[i + 1] - x[i]);
  mean /= static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) differences[i] = hann(i, n) * (differences[i] - mean);
  return differences;
}

std::vector<HandleSpectrum::Band> HandleSpectrum::bands() const {
  const std::size_t n = samples();
  if (n < 2 || places_.size() < n + 2) return {};
  const std::vector<Vec3> differences = windowed_differences();
  const double line_Hz = 1.0 / (static_cast<double>(n) * period_s_), highest_Hz = 0.5 / period_s_;
  std::vector<Band> bands;
  for (int band = first_band; band <= last_band; ++band) {
    const double low_Hz = std::pow(10.0, (band - 0.5) / 10.0), high_Hz = std::pow(10.0, (band + 0.5) / 10.0);
    if (high_Hz > highest_Hz) break;
    double sum = 0.0, differences_sum = 0.0, weighted = 0.0;
    for (auto line = static_cast<std::size_t>(std::ceil(low_Hz / line_Hz));
         static_cast<double>(line) * line_Hz < high_Hz; ++line) {
      const double f_Hz = static_cast<double>(line) * line_Hz;
      const double radians = 2.0 * std::numbers::pi * f_Hz * period_s_;
      // 2 |X|/Σw of the position whose second differences these are. Σw of Hann's window is n/2.
      const double of_place = 4.0 / (static_cast<double>(n) * 2.0 * (1.0 - std::cos(radians)));
      const double squared = power(differences, radians);
      sum += of_place * of_place * squared;
      differences_sum += squared;
      weighted += squared * f_Hz;
    }
    bands.push_back({.centre_Hz = std::pow(10.0, band / 10.0),
                     .amplitude_m = std::sqrt(sum / hann_bandwidth),
                     .frequency_Hz = differences_sum > 0.0 ? weighted / differences_sum : 0.0});
  }
  return bands;
}

}  // namespace proxarm::controller
