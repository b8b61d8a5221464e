// Which oscillations last, by their amplitude over time.
#include "controller/stability/spell.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string>

namespace proxarm::controller {
namespace {

constexpr double period_s = 1e-3;

// When an oscillation of this amplitude over time is first said to last. ⟨x̃²⟩ is averaged over 0.1 s, as
// PassivityObserver does it, of a swing along one line.
std::optional<double> told_s(
    double frequency_Hz, double until_s, const std::function<double(double)>& amplitude_m,
    const std::function<bool(double)>& oscillates = [](double) { return true; }) {
  Spell spell{SpellConfig{}};
  const double omega = 2.0 * std::numbers::pi * frequency_Hz, weight = 1.0 - std::exp(-period_s / 0.1);
  double square = 0.0, speed_square = 0.0;
  for (int k = 1; k * period_s <= until_s; ++k) {
    const double t = k * period_s, A = amplitude_m(t);
    square += weight * (std::pow(A * std::sin(omega * t), 2) - square);
    speed_square += weight * (std::pow(A * omega * std::cos(omega * t), 2) - speed_square);
    spell.step({.oscillates = oscillates(t), .square_m2 = square, .speed_square_m2_per_s2 = speed_square}, period_s);
    if (spell.lasts()) return t;
  }
  return std::nullopt;
}

// The story: the largest swing of a spell was never forgotten. A loop that swung by 9 mm at 14 Hz after a jerk of 20 mm
// did so for 11 s, undamped, without a word and with status 0.
TEST(Spell, ALimitCycleBelowAnEarlierJerkIsToldWithinTwoSeconds) {
  for (const double frequency_Hz : {4.0, 8.0, 14.0, 30.0}) {
    for (double left = 0.2; left < 1.0; left += 0.05) {
      SCOPED_TRACE(std::to_string(frequency_Hz) + " Hz, " + std::to_string(left) + " of the jerk");
      const auto told =
          told_s(frequency_Hz, 8.0, [&](double t) { return 0.01 * (left + (1.0 - left) * std::exp(-t / 0.1)); });
      ASSERT_TRUE(told.has_value());
      EXPECT_LT(*told, 2.0);
    }
  }
}

TEST(Spell, WhatDecaysNeverLasts) {
  for (const double frequency_Hz : {3.0, 3.7, 5.0, 9.0, 20.0}) {
    for (const double tau_s : {0.1, 0.3, 0.6, 0.9, 1.2, 1.6, 2.0}) {
      for (const double size_m : {0.0005, 0.003, 0.05}) {
        SCOPED_TRACE(std::to_string(frequency_Hz) + " Hz, tau " + std::to_string(tau_s) + " s");
        EXPECT_FALSE(told_s(frequency_Hz, 12.0, [&](double t) { return size_m * std::exp(-t / tau_s); }).has_value());
      }
    }
  }
}

TEST(Spell, WhatGoesOnIsToldAfterHalfASecondAndWhatIsHardlyFeltAfterThree) {
  const auto told = [](double amplitude_m) { return told_s(8.0, 5.0, [=](double) { return amplitude_m; }); };
  EXPECT_NEAR(*told(0.002), 0.5, 0.1);  // the average's own rise
  EXPECT_NEAR(*told(0.0004), 3.0, 0.1);
}

TEST(Spell, APauseEndsItAndAShortOneDoesnt) {
  const auto told = [](double pause_s) {
    return told_s(
        8.0, 2.0, [](double) { return 0.002; }, [=](double t) { return std::fmod(t, 0.1 + pause_s) < 0.1; });
  };
  EXPECT_TRUE(told(0.2).has_value());
  EXPECT_FALSE(told(0.3).has_value());
}

}  // namespace
}  // namespace proxarm::controller
