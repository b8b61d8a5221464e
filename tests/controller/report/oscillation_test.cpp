#include "controller/report/oscillation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3;

// A hand that goes back and forth by will, and the arm that swings by itself upon it.
Vec3 tool(double t, double frequency_Hz, double amplitude_m) {
  const Vec3 by_will(0.05 * std::sin(2.0 * std::numbers::pi * 0.3 * t), 0.3, 0.0);
  return by_will + amplitude_m * std::sin(2.0 * std::numbers::pi * frequency_Hz * t) * Vec3(0.6, 0.0, 0.8);
}

OscillationWatch::Cycle cycle(bool oscillates, const Vec3& tool_W) {
  return {.oscillates = oscillates, .tool_W = tool_W};
}

TEST(OscillationWatch, TellsFrequencyAmplitudeAndTimeWhateverTheHandDoesByWill) {
  for (const double frequency_Hz : {3.5, 8.0, 16.0, 40.0}) {
    for (const double amplitude_m : {1e-3, 2e-2}) {
      OscillationWatch watch;
      for (int k = 0; k < 8000; ++k) {
        const double t = k * T;
        watch.add(t, T, cycle(t >= 3.0 && t < 6.0, tool(t, frequency_Hz, amplitude_m)));
      }
      const Oscillation o = watch.longest();
      EXPECT_NEAR(o.from_s, 3.0, 1e-9);
      EXPECT_NEAR(o.duration_s, 3.0, 1e-9);
      // What the high-pass leaves of 0.05 m at 0.3 Hz is nothing beside that.
      EXPECT_NEAR(o.amplitude_m, amplitude_m, 0.05 * amplitude_m) << frequency_Hz;
      EXPECT_NEAR(o.frequency_Hz, frequency_Hz, 0.02 * frequency_Hz);
    }
  }
}

// Place and rotation swing together, and each has its amplitude; a rotation alone has a frequency, too.
TEST(OscillationWatch, TellsByWhatAngleToo) {
  for (const double amplitude_m : {0.0, 1e-3}) {
    OscillationWatch watch;
    for (int k = 0; k < 6000; ++k) {
      const double t = k * T;
      OscillationWatch::Cycle each = cycle(t >= 2.0, tool(t, 16.0, amplitude_m));
      each.turns = true;
      each.turned_W = 0.01 * std::sin(2.0 * std::numbers::pi * 16.0 * t + 1.0) * Vec3(0.0, 0.8, -0.6);
      each.gyration_m2 = 0.002;
      watch.add(t, T, each);
    }
    const Oscillation o = watch.longest();
    EXPECT_NEAR(o.frequency_Hz, 16.0, 0.3);
    EXPECT_NEAR(o.amplitude_m, amplitude_m, 0.05e-3);
    ASSERT_TRUE(o.amplitude_rad);
    EXPECT_NEAR(*o.amplitude_rad, 0.01, 0.05 * 0.01);
  }
}

TEST(OscillationWatch, AToolThatDoesntTurnHasNoAngle) {
  OscillationWatch watch;
  for (int k = 0; k < 2000; ++k) watch.add(k * T, T, cycle(true, tool(k * T, 8.0, 1e-3)));
  EXPECT_FALSE(watch.longest().amplitude_rad);
}

// As a blow that rings for long beside an oscillation that is short, since it was damped.
TEST(OscillationWatch, TheOneThatLastsIsTheVerdict) {
  OscillationWatch watch;
  for (int k = 0; k < 700; ++k) watch.add(k * T, T, {true, k > 500, tool(k * T, 8.0, 1e-3)});
  EXPECT_TRUE(watch.present().lasts);
  watch.reset();
  for (int k = 0; k < 3000; ++k) watch.add(2.0 + k * T, T, cycle(true, tool(k * T, 8.0, 1e-3)));
  EXPECT_FALSE(watch.present().lasts);
  EXPECT_TRUE(watch.longest().lasts);
  EXPECT_NEAR(watch.longest().duration_s, 0.7, 1e-9);
}

TEST(OscillationWatch, TakesTheLongestSpellAndBridgesShortPauses) {
  OscillationWatch watch;
  const auto says = [](double t) {
    if (t >= 1.0 && t < 1.4) return true;                         // a blow
    return t >= 3.0 && t < 5.0 && std::fmod(t - 3.0, 0.3) < 0.1;  // a wall ends it for 0.2 s in each 0.3 s
  };
  for (int k = 0; k < 8000; ++k) watch.add(k * T, T, cycle(says(k * T), tool(k * T, 8.0, 1e-3)));
  EXPECT_NEAR(watch.longest().from_s, 3.0, 1e-9);
  EXPECT_NEAR(watch.longest().duration_s, 1.9, 2e-3);
  EXPECT_EQ(watch.present().duration_s, 0.0);
}

TEST(OscillationWatch, HasNothingToSayWhereNothingSwung) {
  OscillationWatch watch;
  for (int k = 0; k < 3000; ++k) watch.add(k * T, T, cycle(false, tool(k * T, 8.0, 1e-2)));
  EXPECT_EQ(watch.longest().duration_s, 0.0);
  EXPECT_FALSE(watch.longest().lasts);
}

TEST(OscillationWatch, BlowsThatLieApartAreNoSpellTogether) {
  OscillationWatch watch;
  for (int k = 0; k < 20000; ++k) watch.add(k * T, T, cycle(k % 500 < 200, tool(k * T, 8.0, 1e-3)));
  EXPECT_NEAR(watch.longest().duration_s, 0.2, 1e-9);
}

TEST(OscillationWatch, AHoldEndsASpell) {
  OscillationWatch watch;
  for (int k = 0; k < 800; ++k) watch.add(k * T, T, cycle(true, tool(k * T, 8.0, 1e-3)));
  watch.reset();
  EXPECT_EQ(watch.present().duration_s, 0.0);
  for (int k = 900; k < 1700; ++k) watch.add(k * T, T, cycle(true, tool(k * T, 8.0, 1e-3)));
  EXPECT_NEAR(watch.longest().duration_s, 0.8, 1e-9);
}

TEST(OscillationWatch, AToolThatStandsIsFinite) {
  OscillationWatch watch;
  for (int k = 0; k < 2000; ++k) watch.add(k * T, T, cycle(true, Vec3::Zero()));
  EXPECT_EQ(watch.longest().amplitude_m, 0.0);
  EXPECT_EQ(watch.longest().frequency_Hz, 0.0);
}

}  // namespace
}  // namespace proxarm::controller
