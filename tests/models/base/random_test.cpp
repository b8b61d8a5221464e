#include "models/base/random.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

namespace proxarm::models {
namespace {

// The C++ standard says what the 10000th number of its engine is, seeded with 5489 ([rand.predef]). Figures that are
// printed in the documentation depend on the sequence.
TEST(Random, IsTheStandardsSequence) {
  Random random(5489);
  double last = 0.0;
  for (int i = 0; i < 10000; ++i) last = random.uniform(0.0, 1.0);
  EXPECT_EQ(last, static_cast<double>(9981545732273789042ULL >> 11) * 0x1p-53);
}

TEST(Random, TheSameSeedGivesTheSameNumbersAndAnotherOneOthers) {
  Random one(7), same(7), other(8);
  int equal = 0;
  for (int i = 0; i < 1000; ++i) {
    const double number = one.uniform(-1.0, 1.0);
    ASSERT_EQ(same.uniform(-1.0, 1.0), number);
    equal += other.uniform(-1.0, 1.0) == number ? 1 : 0;
  }
  EXPECT_EQ(equal, 0);
}

// Means and shares of 100 000 numbers, to five standard deviations.
TEST(Random, FillsItsRangesEvenly) {
  Random random(1);
  constexpr int count = 100'000;
  double sum = 0.0, log_sum = 0.0;
  int chances = 0;
  std::array<int, 5> of_five{};
  for (int i = 0; i < count; ++i) {
    const double number = random.uniform(2.0, 3.0), decades = random.log_uniform(1e-3, 1e3);
    ASSERT_TRUE(number >= 2.0 && number < 3.0);
    ASSERT_TRUE(decades >= 0.999e-3 && decades <= 1.001e3);
    sum += number;
    log_sum += std::log10(decades);
    chances += random.chance(0.3) ? 1 : 0;
    ++of_five.at(static_cast<std::size_t>(random.below(5)));
  }
  EXPECT_NEAR(sum / count, 2.5, 5.0 * std::sqrt(1.0 / 12.0 / count));
  EXPECT_NEAR(log_sum / count, 0.0, 5.0 * 6.0 * std::sqrt(1.0 / 12.0 / count));
  EXPECT_NEAR(chances, 0.3 * count, 5.0 * std::sqrt(0.3 * 0.7 * count));
  for (const int share : of_five) EXPECT_NEAR(share, 0.2 * count, 5.0 * std::sqrt(0.2 * 0.8 * count));
}

template <int N>
void expect_even_directions() {
  Random random(2);
  constexpr int count = 20'000;
  Eigen::Matrix<double, N, 1> sum = Eigen::Matrix<double, N, 1>::Zero(), squares = sum;
  for (int i = 0; i < count; ++i) {
    const Eigen::Matrix<double, N, 1> v = random.direction<N>(), b = random.in_box<N>(0.5);
    ASSERT_NEAR(v.norm(), 1.0, 1e-15);
    ASSERT_LE(b.cwiseAbs().maxCoeff(), 0.5);
    sum += v;
    squares += v.cwiseAbs2();
  }
  // A coordinate's square is 1/N on average; its standard deviation is below ½, that of the coordinate below 1.
  for (int i = 0; i < N; ++i) {
    EXPECT_NEAR(sum[i] / count, 0.0, 5.0 / std::sqrt(count)) << N;
    EXPECT_NEAR(squares[i] / count, 1.0 / N, 2.5 / std::sqrt(count)) << N;
  }
}

TEST(Random, PointsInAllDirectionsAlike) {
  expect_even_directions<1>();
  expect_even_directions<2>();
  expect_even_directions<3>();
}

TEST(Random, ArrowsAreAsLongAsAsked) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const double length = random.arrow(0.2, 0.4).norm(), decades = random.log_arrow(1e-4, 1e2).norm();
    ASSERT_TRUE(length > 0.1999 && length < 0.4001) << length;
    ASSERT_TRUE(decades > 0.999e-4 && decades < 1.001e2) << decades;
  }
}

}  // namespace
}  // namespace proxarm::models
