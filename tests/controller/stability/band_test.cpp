// The filter that takes the band of oscillations: what a joint that reports seldom leaves in it.
#include "controller/stability/band.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

namespace proxarm::controller {
namespace {

using models::Vec3;

// Of a constant speed that is seen in steps of the place at this rate: how far the smoothed one is from it, in squares.
double ripple_share(double report_rate_Hz, double period_s) {
  Band band;
  band.design({.report_rate_Hz = report_rate_Hz}, period_s);
  double ripple = 0.0, reported = 0.0;
  int counted = 0;
  const int cycles = static_cast<int>(8.0 / period_s);
  for (int k = 0; k < cycles; ++k) {
    const double place = std::floor(k * period_s * report_rate_Hz + 1e-9) / report_rate_Hz;  // at 1 m/s
    const double smooth = band.smooth(Vec3((place - reported) / period_s, 0.0, 0.0)).x();
    reported = place;
    if (k < cycles / 2) continue;
    ripple += (smooth - 1.0) * (smooth - 1.0);
    ++counted;
  }
  return ripple / counted;
}

// The story: on a rail that reports 200 times a second four fifths of ⟨ẋ²⟩ were its steps. They lay in the band of
// oscillations, so any motion of a hand was one.
TEST(Band, AJointThatReportsSeldomLeavesATenthOfTheLeastShare) {
  for (const double period_s : {1e-3, 2e-3, 4e-3}) {
    for (const double rate_Hz : {20.0, 50.0, 100.0, 200.0}) {
      if (rate_Hz * period_s > 0.7) continue;  // steps of one and two cycles by turns: below f_r
      SCOPED_TRACE(std::to_string(rate_Hz) + "/s at " + std::to_string(1e3 * period_s) + " ms");
      // 0.02, and as much for the harmonics and where the bilinear transform bends the slope.
      EXPECT_LT(ripple_share(rate_Hz, period_s), 0.04);
    }
  }
}

TEST(Band, LeavesNothingOutWhereEachCycleHasAReport) {
  for (const double rate_Hz : {0.0, 1000.0, 2000.0}) {
    Band band;
    band.design({.report_rate_Hz = rate_Hz}, 1e-3);
    const Vec3 any(0.3, -1e-9, 7.0);
    EXPECT_EQ(band.smooth(any), any);
  }
}

TEST(Band, PassesOscillationsAndHoldsBackWhatHandsDoByWill) {
  const auto passes = [](double frequency_Hz, double report_rate_Hz) {
    Band band;
    band.design({.report_rate_Hz = report_rate_Hz}, 1e-3);
    double most = 0.0;
    for (int k = 0; k < 4000; ++k) {
      const double in = std::sin(2.0 * std::numbers::pi * frequency_Hz * 1e-3 * k);
      const double out = band.step(Vec3(in, 0.0, 0.0)).x();
      if (k > 2000) most = std::max(most, std::abs(out));
    }
    return most;
  };
  for (const double report_rate_Hz : {0.0, 200.0}) {
    EXPECT_NEAR(passes(3.0, report_rate_Hz), std::numbers::sqrt2 / 2.0, 0.01);
    EXPECT_NEAR(passes(1.5, report_rate_Hz), 1.0 / 16.03, 0.002);  // (1 + 2⁸)^−½
    EXPECT_GT(passes(20.0, report_rate_Hz), 0.98);
  }
  EXPECT_NEAR(passes(53.2, 200.0), std::numbers::sqrt2 / 2.0, 0.02);
}

}  // namespace
}  // namespace proxarm::controller
