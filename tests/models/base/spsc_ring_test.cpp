#include "models/base/spsc_ring.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <thread>

namespace proxarm::controller {
namespace {

TEST(SpscRing, RoundsItsCapacityUpToAPowerOfTwo) {
  EXPECT_EQ(SpscRing<int>(0).capacity(), 2u);
  EXPECT_EQ(SpscRing<int>(5).capacity(), 8u);
  EXPECT_EQ(SpscRing<int>(64).capacity(), 64u);
}

TEST(SpscRing, KeepsOrderAndRefusesWhenFull) {
  SpscRing<int> ring(4);
  int out = -1;
  EXPECT_FALSE(ring.pop(out));
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.push(round * 10 + i));
    EXPECT_FALSE(ring.push(99));
    EXPECT_EQ(ring.dropped(), static_cast<std::uint64_t>(round + 1));
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(ring.pop(out));
      EXPECT_EQ(out, round * 10 + i);
    }
    EXPECT_FALSE(ring.pop(out));
    EXPECT_EQ(out, round * 10 + 3) << "an empty ring leaves the item alone";
  }
}

// Items of several cache lines, a small ring that is full and empty all the time: nothing torn, lost or out of order.
// The thread sanitizer runs this one, too.
TEST(SpscRing, PassesWholeItemsBetweenTwoThreads) {
  struct Item {
    std::array<std::uint64_t, 24> words;
  };
  SpscRing<Item> ring(8);
  constexpr std::uint64_t count = 200000;
  std::thread producer([&ring] {
    Item item{};
    for (std::uint64_t i = 0; i < count; ++i) {
      item.words.fill(i);
      while (!ring.push(item)) std::this_thread::yield();
    }
  });
  Item item{};
  for (std::uint64_t i = 0; i < count; ++i) {
    while (!ring.pop(item)) std::this_thread::yield();
    for (const std::uint64_t word : item.words) ASSERT_EQ(word, i);
  }
  producer.join();
  EXPECT_FALSE(ring.pop(item));
}

}  // namespace
}  // namespace proxarm::controller
