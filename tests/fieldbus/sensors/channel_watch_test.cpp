// The story: a gauge that was stuck alone made a force of its own, and nobody noticed: only all six together counted.
#include "fieldbus/sensors/channel_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace proxarm::fieldbus {
namespace {

struct ChannelWatchTest : ::testing::Test {
  // Samples of six channels with this noise before rounding; `stuck` repeats what it had.
  void add(int samples, double sigma_counts, int stuck = -1) {
    std::normal_distribution<double> noise{0.0, 1.0};
    for (int k = 0; k < samples; ++k) {
      for (int i = 0; i < 6; ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (i != stuck) counts[at] = std::nearbyint(100.0 * i + 0.1 * i + sigma_counts * noise(generator));
      }
      watch.add(counts);
      most = std::max(most, watch.repeats());
    }
  }
  ChannelWatch watch;
  std::array<double, 6> counts{};
  std::uint32_t most = 0;
  std::mt19937 generator{5};
};

TEST_F(ChannelWatchTest, FindsAnyOneThatRepeatsWhileOthersGoOn) {
  for (int stuck = 0; stuck < 6; ++stuck) {
    watch = {};
    add(300, 0.8);
    add(102, 0.8, stuck);
    EXPECT_GT(watch.repeats(), ChannelWatch::most_repeats) << stuck;
    add(30, 0.8);
    EXPECT_LT(watch.repeats(), 50u) << "it goes on again";
  }
}

TEST_F(ChannelWatchTest, NeverSuspectsAChannelThatOnlyHasLittleNoise) {
  for (const double sigma : {0.0, 0.05, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0, 5.0}) {
    watch = {};
    most = 0;
    add(200'000, sigma);
    EXPECT_LT(most, ChannelWatch::most_repeats / 2) << sigma << " counts";
  }
}

TEST_F(ChannelWatchTest, IsNotMisledByAPushWhileItLearns) {
  // A slow push, 20 counts in the 200 samples, on channels of little noise: steps, no noise.
  for (int k = 0; k < 200; ++k) {
    for (std::size_t i = 0; i < 6; ++i) counts[i] = std::nearbyint(0.1 * k);
    watch.add(counts);
  }
  for (int k = 0; k < 500; ++k) {
    counts[0] += 1.0;
    watch.add(counts);
  }
  EXPECT_EQ(watch.repeats(), 0u);
}

TEST_F(ChannelWatchTest, LeavesReadingsThatRepeatAsAWholeToOthers) {
  add(300, 0.8);
  const std::uint32_t before = watch.repeats();
  for (int k = 0; k < 1'000; ++k) watch.add(counts);
  EXPECT_EQ(watch.repeats(), before);
}

}  // namespace
}  // namespace proxarm::fieldbus
