#include "models/base/triple_buffer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <thread>

namespace proxarm::fieldbus {
namespace {

TEST(TripleBuffer, HasNothingBeforeTheFirstValue) {
  TripleBuffer<int> buffer;
  int out = 7;
  EXPECT_FALSE(buffer.read(out));
  EXPECT_EQ(out, 7);
}

TEST(TripleBuffer, GivesEachValueOnceAndOnlyTheLatest) {
  TripleBuffer<int> buffer;
  int out = 0;
  for (int round = 0; round < 10; ++round) {
    for (int missed = 0; missed < round; ++missed) buffer.write(-1);
    buffer.write(100 + round);
    ASSERT_TRUE(buffer.read(out));
    EXPECT_EQ(out, 100 + round);
    EXPECT_FALSE(buffer.read(out)) << "nothing new";
    EXPECT_EQ(out, 100 + round);
  }
}

// Values of several cache lines: none is torn, and none comes after a later one. The thread sanitizer runs this one,
// too.
TEST(TripleBuffer, NeverShowsHalfOfAValueToAnotherThread) {
  struct Value {
    std::array<std::uint64_t, 24> words;
  };
  constexpr std::uint64_t last = 200'000;
  TripleBuffer<Value> buffer;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= last; ++i) {
      Value value;
      value.words.fill(i);
      buffer.write(value);
    }
  });
  std::uint64_t before = 0, torn = 0, backwards = 0;
  Value value{};
  while (before < last) {
    if (!buffer.read(value)) {
      std::this_thread::yield();
      continue;
    }
    for (const std::uint64_t word : value.words) torn += word != value.words[0] ? 1 : 0;
    backwards += value.words[0] <= before ? 1 : 0;
    before = value.words[0];
  }
  writer.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(backwards, 0u);
}

}  // namespace
}  // namespace proxarm::fieldbus
