#include "controller/cycle/requests.hpp"

#include <gtest/gtest.h>

#include "tests/allocation_count.hpp"

namespace proxarm::controller {
namespace {

TEST(Requests, ComeFromTheScriptAtTheirTimesAndInItsOrder) {
  Requests<int> requests(4);
  requests.schedule({{10, 1}, {10, 2}, {30, 3}});
  int taken = 0;
  EXPECT_FALSE(requests.take(9, taken));
  ASSERT_TRUE(requests.take(10, taken));
  EXPECT_EQ(taken, 1);
  ASSERT_TRUE(requests.take(11, taken)) << "the second one of the same time has the next cycle";
  EXPECT_EQ(taken, 2);
  EXPECT_FALSE(requests.take(29, taken));
  ASSERT_TRUE(requests.take(1000, taken));
  EXPECT_EQ(taken, 3);
  EXPECT_FALSE(requests.take(2000, taken));
  EXPECT_EQ(requests.taken_from_thread(), 0u);
}

TEST(Requests, OfAThreadWaitForTheScript) {
  Requests<int> requests(4);
  requests.schedule({{10, 1}});
  EXPECT_TRUE(requests.push(7));
  int taken = 0;
  ASSERT_TRUE(requests.take(10, taken));
  EXPECT_EQ(taken, 1);
  ASSERT_TRUE(requests.take(10, taken));
  EXPECT_EQ(taken, 7);
  EXPECT_EQ(requests.taken_from_thread(), 1u);
}

TEST(Requests, ThatAreDueCanBeLookedAtWithoutTakingThem) {
  Requests<int> requests(4);
  requests.schedule({{10, 1}});
  EXPECT_EQ(requests.due(9), nullptr);
  ASSERT_NE(requests.due(10), nullptr);
  EXPECT_EQ(*requests.due(10), 1);
  int taken = 0;
  EXPECT_TRUE(requests.take(10, taken));
  EXPECT_EQ(requests.due(10), nullptr);
}

TEST(Requests, OfTheScriptTellWhatBecameOfThem) {
  Requests<int> requests(4);
  requests.schedule({{10, 1}, {20, 2}, {30, 3}});
  int taken = 0;
  EXPECT_TRUE(requests.take(10, taken));
  requests.note_refusal("a reason");
  EXPECT_TRUE(requests.take(20, taken));
  requests.push(7);
  EXPECT_TRUE(requests.take(21, taken));
  requests.note_refusal("of the thread's, which nobody keeps");
  const auto script = requests.script();
  EXPECT_TRUE(script[0].taken);
  EXPECT_STREQ(script[0].refusal, "a reason");
  EXPECT_TRUE(script[1].taken);
  EXPECT_EQ(script[1].refusal, nullptr);
  EXPECT_FALSE(script[2].taken);
}

TEST(Requests, BeyondTheRingsRoomAreRefused) {
  Requests<int> requests(2);
  EXPECT_TRUE(requests.push(1));
  EXPECT_TRUE(requests.push(2));
  EXPECT_FALSE(requests.push(3));
}

TEST(Requests, AreTakenWithoutTheHeap) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  Requests<int> requests(8);
  requests.schedule({{0, 1}, {0, 2}});
  const std::uint64_t before = tests::allocation_count();
  int taken = 0;
  for (int i = 0; i < 5; ++i) {
    requests.push(i);
    requests.take(0, taken);
  }
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace proxarm::controller
