#include "controller/signals/handle_spectrum.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace proxarm::controller {
namespace {

using models::Vec3;

// What a place at a time is, by its definition.
template <typename Place>
HandleSpectrum heard(const Place& place, double period_s = 1e-3, double seconds = 1.5) {
  HandleSpectrum spectrum;
  for (int k = 0; k * period_s < seconds; ++k) spectrum.add(k * period_s, period_s, place(k * period_s));
  return spectrum;
}

double sine(double frequency_Hz, double t) { return std::sin(2.0 * std::numbers::pi * frequency_Hz * t + 0.7); }

const HandleSpectrum::Band* band_of(const std::vector<HandleSpectrum::Band>& bands, double frequency_Hz) {
  for (const auto& band : bands) {
    if (std::abs(std::log10(frequency_Hz / band.centre_Hz)) <= 0.05) return &band;
  }
  return nullptr;
}

TEST(HandleSpectrum, ASineHasItsAmplitudeAndItsFrequency) {
  const Vec3 along = Vec3(1.0, 2.0, 2.0) / 3.0;
  for (const double frequency_Hz : {10.0, 25.3, 50.0, 101.7, 163.3, 250.0, 397.1}) {
    for (const double amplitude_m : {2e-8, 5e-6, 1e-3}) {
      const auto bands = heard([&](double t) -> Vec3 { return amplitude_m * sine(frequency_Hz, t) * along; }).bands();
      const auto* const band = band_of(bands, frequency_Hz);
      ASSERT_NE(band, nullptr) << frequency_Hz;
      EXPECT_NEAR(band->amplitude_m, amplitude_m, 0.02 * amplitude_m) << frequency_Hz;
      EXPECT_NEAR(band->frequency_Hz, frequency_Hz, 0.1) << frequency_Hz;
    }
  }
}

// The threshold at 10 Hz is some micrometres, and a hand leads the tool over 100 mm within a second.
TEST(HandleSpectrum, AHandThatLeadsTheToolIsNoVibration) {
  const auto bands = heard([](double t) -> Vec3 { return {0.1 * sine(0.7, t), 0.3 * t, 0.02 * sine(2.0, t)}; }).bands();
  ASSERT_EQ(bands.size(), 17U);
  for (const auto& band : bands) {
    EXPECT_LT(band.amplitude_m, band.centre_Hz > 30.0 ? 1e-8 : 1e-6) << band.centre_Hz;
  }
}

TEST(HandleSpectrum, TwoSinesAreTwoBands) {
  const auto bands = heard([](double t) -> Vec3 { return {1e-6 * sine(40.0, t), 0.0, 3e-7 * sine(160.0, t)}; }).bands();
  EXPECT_NEAR(band_of(bands, 40.0)->amplitude_m, 1e-6, 2e-8);
  EXPECT_NEAR(band_of(bands, 160.0)->amplitude_m, 3e-7, 6e-9);
  EXPECT_LT(band_of(bands, 80.0)->amplitude_m, 1e-9);
}

// Of noise of variance σ² a band has its share of the power, σ² (f2 − f1)/(fs/2), and of a sine as strong A² = 2 P.
TEST(HandleSpectrum, NoiseHasThePowerOfItsBand) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 1e-6);
  double squared = 0.0;
  constexpr int runs = 40;
  for (int run = 0; run < runs; ++run) {
    const auto bands = heard([&](double) -> Vec3 { return {noise(random), 0.0, 0.0}; }).bands();
    squared += std::pow(band_of(bands, 200.0)->amplitude_m, 2) / runs;
  }
  const double share = 200.0 * (std::pow(10.0, 0.05) - std::pow(10.0, -0.05)) / 500.0;
  EXPECT_NEAR(squared, 2.0 * share * 1e-12, 0.15 * 2.0 * share * 1e-12);
}

TEST(HandleSpectrum, EndsAtHalfTheRateOfTheCycle) {
  const auto bands = heard([](double t) -> Vec3 { return {1e-6 * sine(100.0, t), 0.0, 0.0}; }, 2e-3).bands();
  ASSERT_FALSE(bands.empty());
  EXPECT_NEAR(bands.back().centre_Hz, 200.0, 1.0);
  EXPECT_NEAR(band_of(bands, 100.0)->amplitude_m, 1e-6, 2e-8);
}

TEST(HandleSpectrum, WaitsForAWholeSecond) {
  const auto still = [](double) { return Vec3(0.9, 0.0, 0.6); };
  EXPECT_TRUE(heard(still, 1e-3, 0.9).bands().empty());
  HandleSpectrum spectrum = heard(still);
  ASSERT_FALSE(spectrum.bands().empty());
  EXPECT_LT(spectrum.bands().front().amplitude_m, 1e-12);
  spectrum.add(3.0, 1e-3, still(3.0));  // cycles are missing before it
  EXPECT_TRUE(spectrum.bands().empty());
  spectrum = heard(still);
  spectrum.add(1.502, 2e-3, still(1.502));  // another timestep
  EXPECT_TRUE(spectrum.bands().empty());
  EXPECT_TRUE(HandleSpectrum().bands().empty());
}

}  // namespace
}  // namespace proxarm::controller
