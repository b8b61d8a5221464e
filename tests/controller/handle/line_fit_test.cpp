#include "controller/handle/line_fit.hpp"

#include <gtest/gtest.h>

#include <random>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3;

TEST(LineFit, GivesAStraightLineBackWithNothingBesideIt) {
  const Vec3 first(3.0, -40.0, 0.5), slope(-2.0, 0.0, 7.0);
  LineFit fit;
  for (int k = 0; k <= 200; ++k) fit.add(first + k * T * slope, T);
  const FittedLine line = fitted(fit, T);
  // 200 sums of numbers of 40 N: 200 · 40 · 1e-16 N.
  EXPECT_LT((line.end_W - first - 0.2 * slope).norm(), 1e-12);
  EXPECT_LT((line.risen_W - 0.2 * slope).norm(), 1e-12);
  EXPECT_LT(line.variance_N2.norm(), 1e-14);
}

// The mean of many estimates is the variance, and they deviate from it by what `deviation` says: both to within four
// standard deviations of 2000 estimates.
TEST(LineFit, EstimatesTheVarianceBesideTheLineAndHowWellItKnowsIt) {
  std::mt19937 generator(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  constexpr int estimates = 2000, samples = 30;
  double sum = 0.0, squares = 0.0, deviation = 0.0;
  for (int i = 0; i < estimates; ++i) {
    LineFit fit;
    for (int k = 0; k < samples; ++k) fit.add({5.0 + 3.0 * k * T + noise(generator), 0.0, 0.0}, T);
    const FittedLine line = fitted(fit, T);
    const double ratio = line.variance_N2.x() / (0.02 * 0.02);
    sum += ratio;
    squares += ratio * ratio;
    deviation = line.deviation;
  }
  const double mean = sum / estimates;
  EXPECT_NEAR(mean, 1.0, 4.0 * deviation / std::sqrt(estimates));
  EXPECT_NEAR(std::sqrt(squares / estimates - mean * mean), deviation,
              4.0 * deviation / std::sqrt(2.0 * estimates) * 1.5)
      << "χ² of 28 degrees has longer tails than a normal distribution: half as much again";
}

TEST(LineFit, BeginsAnewWithTheNextSampleWhereItsCountIsZero) {
  LineFit fit;
  for (int k = 0; k < 50; ++k) fit.add({1.0 * k, 2.0, 3.0}, T);
  fit.n = 0.0;
  for (int k = 0; k < 50; ++k) fit.add({7.0, 8.0, 9.0}, T);
  const FittedLine line = fitted(fit, T);
  EXPECT_EQ(line.end_W, Vec3(7.0, 8.0, 9.0));
  EXPECT_EQ(line.risen_W, Vec3::Zero());
}

}  // namespace
}  // namespace proxarm::controller
