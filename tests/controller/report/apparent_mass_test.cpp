#include "controller/report/apparent_mass.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double period_s = 1e-3;
const Vec3 direction = Vec3(2.0, -1.0, 0.5).normalized();

// Position along `direction`, twice differentiable; the tests' truth has its derivatives by formula, not by
// differences.
struct Motion {
  std::function<double(double)> x, v, a;
};

// Minimum-jerk move over `distance` in `duration`, then rest.
Motion reach(double distance, double duration) {
  const auto s = [duration](double t) { return std::clamp(t / duration, 0.0, 1.0); };
  return {[=](double t) { return distance * std::pow(s(t), 3) * (10 - 15 * s(t) + 6 * s(t) * s(t)); },
          [=](double t) { return distance / duration * 30 * std::pow(s(t) * (1 - s(t)), 2); },
          [=](double t) { return distance / (duration * duration) * 60 * s(t) * (1 - s(t)) * (1 - 2 * s(t)); }};
}

Motion multisine() {
  const auto sum = [](double t, int derivative) {
    double total = 0.0;
    int i = 0;
    for (const double f : {0.13, 0.31, 0.52, 0.83, 1.21, 1.74, 2.6, 4.1}) {
      const double w = 2 * std::numbers::pi * f, phase = w * t + 1.3 * i++;
      const double amplitude = 0.01 / (1 + f);
      total += derivative == 0   ? amplitude * std::sin(phase)
               : derivative == 1 ? amplitude * w * std::cos(phase)
                                 : -amplitude * w * w * std::sin(phase);
    }
    return total;
  };
  return {[=](double t) { return sum(t, 0); }, [=](double t) { return sum(t, 1); },
          [=](double t) { return sum(t, 2); }};
}

struct Hand {
  double mass_kg = 4.0, damping_Ns_per_m = 0.0, offset_N = 0.0, noise_N = 0.0;
  double delay_s = 0.0;       // of the tool behind what the force says
  double resonance_Hz = 0.0;  // a force that the model doesn't hold
};

void feed(ApparentMass& estimator, const Motion& motion, const Hand& hand, double from_s, double to_s) {
  std::mt19937_64 generator(5);
  std::normal_distribution<> noise(0.0, 1.0);
  for (int k = 0; from_s + k * period_s < to_s; ++k) {
    const double t = from_s + k * period_s, ahead = t + hand.delay_s;
    const double F = hand.mass_kg * motion.a(ahead) + hand.damping_Ns_per_m * motion.v(ahead) + hand.offset_N +
                     hand.noise_N * noise(generator) +
                     (hand.resonance_Hz > 0 ? 2.0 * std::sin(2 * std::numbers::pi * hand.resonance_Hz * t) : 0.0);
    estimator.add(F * direction, motion.x(t) * direction + Vec3(1.0, 0.2, 0.9));
  }
  estimator.end_segment();
}

ApparentMass::Estimate estimate(const Motion& motion, const Hand& hand, double from_s, double to_s) {
  ApparentMass estimator(period_s);
  feed(estimator, motion, hand, from_s, to_s);
  const auto result = estimator.estimate();
  EXPECT_TRUE(result.has_value());
  return result.value_or(ApparentMass::Estimate{});
}

TEST(ApparentMass, FindsMassAndDampingOfACleanMultisine) {
  for (const double M : {0.5, 2.0, 10.0, 60.0}) {
    for (const double B : {0.0, 15.0}) {
      const auto result = estimate(multisine(), {.mass_kg = M, .damping_Ns_per_m = B}, 0.0, 37.0);
      // Central differences err by (ωT)²/12 and (ωT)²/6 at most: 1.3e-5 and 2.6e-5 of what is in the band's reach.
      EXPECT_NEAR(result.mass_kg, M, 1e-4 * (M + B));
      EXPECT_NEAR(result.damping_Ns_per_m, B, 1e-4 * (10 * M + B));
    }
  }
}

TEST(ApparentMass, FindsTheMassInOneShortReach) {
  for (const double M : {2.0, 4.0, 20.0}) {
    for (const double duration : {0.8, 1.5, 3.0}) {
      // Cut off in full motion, as the wall does it.
      for (const double until : {0.75, 1.0, 1.3}) {
        if (duration * until < 0.55) continue;
        const auto result = estimate(reach(0.3, duration), {.mass_kg = M, .damping_Ns_per_m = 5.0, .offset_N = 0.4},
                                     0.0, duration * until);
        EXPECT_NEAR(result.mass_kg, M, 1e-3 * M) << duration << " s, until " << until;
      }
    }
  }
}

// 0.2 N of white noise at 1 kHz, an offset, 5 ms of delay (Re(F/a) loses (ωτ)²/2, 0.2 % at 2 Hz; the damping loses
// Mω²τ, 1.8 Ns/m at 1.5 Hz, which is how a lag feels), and 2 N at 12 Hz, where arms have their first mode: the mass is
// still within the 1 % that the estimator owes.
TEST(ApparentMass, WithstandsNoiseOffsetDelayAndResonance) {
  const Hand hand{
      .mass_kg = 4.0, .damping_Ns_per_m = 3.0, .offset_N = -1.0, .noise_N = 0.2, .delay_s = 5e-3, .resonance_Hz = 12.0};
  EXPECT_NEAR(estimate(multisine(), hand, 0.0, 60.0).mass_kg, 4.0, 0.04);
  const double damping = estimate(multisine(), hand, 0.0, 60.0).damping_Ns_per_m;
  EXPECT_LT(damping, 3.0);
  EXPECT_GT(damping, 0.0);
  EXPECT_NEAR(estimate(reach(0.3, 1.2), hand, 0.0, 1.3).mass_kg, 4.0, 0.04);
  EXPECT_NEAR(estimate(reach(0.3, 1.2), hand, 0.0, 1.0).mass_kg, 4.0, 0.04);
}

// A lag of 15 ms, as of an arm whose setpoints are smoothed: the mass is still right in one short reach, the damping
// says it.
TEST(ApparentMass, TellsLagFromLightness) {
  for (const double until : {0.8, 1.0, 1.3}) {
    const auto result = estimate(reach(0.2, 1.5), {.mass_kg = 4.0, .delay_s = 15e-3}, 0.0, 1.5 * until);
    EXPECT_NEAR(result.mass_kg, 4.0, 0.04) << until;
    EXPECT_LT(result.damping_Ns_per_m, 0.0);
  }
  const auto steady = estimate(multisine(), {.mass_kg = 4.0, .delay_s = 15e-3}, 0.0, 60.0);
  // Re(F/a) is M cos(ωτ), which falls to 3.93 kg at 2 Hz.
  EXPECT_GT(steady.mass_kg, 3.93);
  EXPECT_LT(steady.mass_kg, 4.0);
}

TEST(ApparentMass, PoolsSegments) {
  ApparentMass estimator(period_s);
  for (int i = 0; i < 5; ++i) feed(estimator, reach(0.2 - 0.05 * i, 1.0), {.mass_kg = 6.0}, 0.0, 1.0);
  ASSERT_TRUE(estimator.estimate());
  EXPECT_NEAR(estimator.estimate()->mass_kg, 6.0, 6e-3);
  EXPECT_NEAR(estimator.estimate()->used_s, 5.0 - 1.0 - 0.0, 1.01);  // the fifth doesn't move
}

TEST(ApparentMass, SaysNothingWhereNothingMoved) {
  ApparentMass estimator(period_s);
  EXPECT_FALSE(estimator.estimate());
  estimator.end_segment();
  feed(estimator, reach(0.0, 1.0), {.noise_N = 0.5}, 0.0, 5.0);
  feed(estimator, reach(0.5e-3, 1.0), {}, 0.0, 5.0);
  feed(estimator, reach(0.2, 1.0), {}, 0.0, 0.4);
  EXPECT_FALSE(estimator.estimate());
}

// A mass felt with a delay: M e^{jωτ}, by arithmetic. The lines of a band are up to a tenth off its middle, and a 5 s
// window sees each sine as 0.4 Hz wide: a per cent of the phase's slope over that.
TEST(FeltMassCurve, SeesADelayGrowWithFrequency) {
  constexpr double M = 4.0, tau = 5e-3;
  FeltMassCurve curve(period_s);
  const double frequencies[] = {0.6, 1.0, 2.0, 4.2, 8.0, 12.2};
  for (int k = 0; k < 30000; ++k) {
    double F = 3.0, x = 0.0;
    for (const double f : frequencies) {
      const double w = 2.0 * std::numbers::pi * f, t = k * period_s;
      x += 0.02 / w * std::sin(w * t);
      F -= M * 0.02 * w * std::sin(w * (t + tau));
    }
    curve.add(F * direction, x * direction);
  }
  const auto points = curve.points();
  ASSERT_GE(points.size(), 6u);
  for (const auto& point : points) {
    const auto nearest = *std::min_element(std::begin(frequencies), std::end(frequencies), [&](double a, double b) {
      return std::abs(a - point.frequency_Hz) < std::abs(b - point.frequency_Hz);
    });
    const auto expected = std::polar(M, 2.0 * std::numbers::pi * nearest * tau);
    EXPECT_LT(std::abs(point.mass_kg - expected), 0.03 * M) << point.frequency_Hz << " Hz: " << point.mass_kg;
  }
  // |e^{jωτ} − 1| = 2 sin(ωτ/2) is 0.25 at 8.0 Hz; points are a fifth apart.
  EXPECT_NEAR(band_within_Hz(points, M, 0.25), 8.0, 1.2);
  EXPECT_EQ(band_within_Hz(points, 8.0, 0.25), 0.0);
}

// 4 kg along x, 6 along y, both moved; along z the tool gives way a little to what happens along the others.
TEST(FeltMassCurve, TellsDirectionsApart) {
  FeltMassCurve curve(period_s);
  for (int k = 0; k < 30000; ++k) {
    const double w = 2.0 * std::numbers::pi * 2.0, t = k * period_s;
    const double a = std::sin(w * t), b = std::cos(w * t);
    curve.add(-w * w * 1e-3 * Vec3(4.0 * a, 6.0 * b, 50.0 * 0.3 * a), 1e-3 * Vec3(a, b, 0.3 * a));
  }
  const auto mass = [&](std::size_t axis) {
    const auto points = curve.points_along(axis);
    const auto at = std::find_if(points.begin(), points.end(), [](const auto& p) { return p.frequency_Hz > 1.9; });
    return at == points.end() ? 0.0 : at->mass_kg.real();
  };
  EXPECT_NEAR(mass(0), 4.0, 1e-3);
  EXPECT_NEAR(mass(1), 6.0, 1e-3);
  EXPECT_TRUE(curve.points_along(2).empty());
}

// As where a tool hangs loose in a hand that leads its place: nothing was felt, not nothing.
TEST(ApparentMass, SaysNothingOfWhatMovesWithoutAHand) {
  ApparentMass estimator(period_s);
  feed(estimator, multisine(), {.mass_kg = 0.0}, 0.0, 8.0);
  estimator.end_segment();
  EXPECT_FALSE(estimator.estimate());
}

TEST(FeltMassCurve, SaysNothingOfWhatWasNotExcited) {
  FeltMassCurve of_noise(period_s), of_a_sine(period_s);
  std::mt19937_64 generator(7);
  std::normal_distribution<> noise(0.0, 1.0);
  for (int k = 0; k < 30000; ++k) {
    of_noise.add(Vec3(noise(generator), 0.0, 0.0), 1e-5 * Vec3(noise(generator), 0.0, 0.0));
    const double w = 2.0 * std::numbers::pi, t = k * period_s;
    of_a_sine.add(Vec3(-4.0 * 0.01 * w * w * std::sin(w * t) + 0.01 * noise(generator), 0.0, 0.0),
                  Vec3(0.01 * std::sin(w * t), 0.0, 0.0));
  }
  EXPECT_TRUE(of_noise.points().empty());
  for (const auto& point : of_a_sine.points()) EXPECT_NEAR(point.frequency_Hz, 1.0, 0.5);
  FeltMassCurve of_short_moves(period_s);
  for (int k = 0; k < 30000; ++k) {
    of_short_moves.add(Vec3::UnitX(), Vec3::UnitX() * std::sin(6.0 * k * period_s));
    if (k % 4000 == 0) of_short_moves.end_segment();
  }
  EXPECT_TRUE(of_short_moves.points().empty());
}

}  // namespace
}  // namespace proxarm::controller
