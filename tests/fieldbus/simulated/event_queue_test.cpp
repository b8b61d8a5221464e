#include "fieldbus/simulated/event_queue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace proxarm::fieldbus {
namespace {

TEST(EventQueue, RunsInOrderOfTimeAndOfSchedulingAmongEqualTimes) {
  EventQueue queue;
  std::string order;
  queue.schedule(20, [&] { order += 'c'; });
  queue.schedule(10, [&] { order += 'a'; });
  queue.schedule(20, [&] { order += 'd'; });
  queue.schedule(10, [&] { order += 'b'; });
  queue.run_until(20);
  EXPECT_EQ(order, "abcd");
  EXPECT_EQ(queue.now_ns(), 20);
  EXPECT_EQ(queue.next_time(), EventQueue::never);
}

TEST(EventQueue, RunsAnEventAtItsLimitAndNoneAfterIt) {
  EventQueue queue;
  int runs = 0;
  queue.schedule(100, [&] { ++runs; });
  queue.schedule(101, [&] { ++runs; });
  queue.run_until(100);
  EXPECT_EQ(runs, 1);
  EXPECT_EQ(queue.next_time(), 101);
}

TEST(EventQueue, GivesTheCallbackItsOwnTime) {
  EventQueue queue(5);
  std::int64_t seen = 0;
  queue.schedule_after(7, [&](std::int64_t time_ns) { seen = time_ns; });
  queue.run_until(1000);
  EXPECT_EQ(seen, 12);
}

TEST(EventQueue, RunsWhatIsScheduledForThePastAtOnceAndNeverStepsBack) {
  EventQueue queue;
  queue.run_until(50);
  std::int64_t at = 0;
  queue.schedule(10, [&](std::int64_t) { at = queue.now_ns(); });
  EXPECT_EQ(queue.next_time(), 50);
  queue.run_until(30);  // before now: nothing is due
  EXPECT_EQ(at, 0);
  EXPECT_EQ(queue.now_ns(), 50);
  queue.run_until(50);
  EXPECT_EQ(at, 50);
}

TEST(EventQueue, RunsEventsThatEventsSchedule) {
  EventQueue queue;
  std::vector<std::int64_t> ticks;
  std::function<void()> tick = [&] {
    ticks.push_back(queue.now_ns());
    queue.schedule_after(10, [&] { tick(); });
  };
  queue.schedule(0, [&] { tick(); });
  queue.run_until(30);
  EXPECT_EQ(ticks, (std::vector<std::int64_t>{0, 10, 20, 30}));
}

TEST(EventQueue, CancelsOnlyWhatIsPending) {
  EventQueue queue;
  int runs = 0;
  const auto first = queue.schedule(1, [&] { ++runs; });
  const auto second = queue.schedule(2, [&] { ++runs; });
  EXPECT_TRUE(queue.cancel(first));
  EXPECT_FALSE(queue.cancel(first));
  queue.run_until(5);
  EXPECT_EQ(runs, 1);
  EXPECT_FALSE(queue.cancel(second));
  const auto third = queue.schedule(6, [&] { ++runs; });  // in the slot of a former event
  EXPECT_FALSE(queue.cancel(first));
  EXPECT_FALSE(queue.cancel(second));
  EXPECT_FALSE(queue.cancel(EventQueue::EventId{}));
  EXPECT_TRUE(queue.cancel(third));
}

TEST(EventQueue, DestroysEveryCallbackExactlyOnce) {
  const auto held = std::make_shared<int>(0);
  {
    EventQueue queue;
    for (int i = 0; i < 100; ++i) queue.schedule(i, [held] { ++*held; });
    const auto cancelled = queue.schedule(1, [held] { *held += 1000; });
    queue.cancel(cancelled);
    EXPECT_EQ(held.use_count(), 101);
    queue.run_until(49);
    EXPECT_EQ(held.use_count(), 51);
    EXPECT_EQ(*held, 50);
  }
  EXPECT_EQ(held.use_count(), 1);
}

// Against a sorted list, with random times, cancellations and re-scheduling from inside.
TEST(EventQueue, AgreesWithASortedListOnRandomSchedules) {
  const unsigned seed = 1;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  EventQueue queue;
  struct Expected {
    std::int64_t time;
    int number;
  };
  std::vector<Expected> expected;
  std::vector<int> seen;
  std::vector<std::pair<EventQueue::EventId, int>> ids;
  for (int i = 0; i < 5000; ++i) {
    const std::int64_t time = random() % 500;
    ids.emplace_back(queue.schedule(time, [&seen, i] { seen.push_back(i); }), i);
    expected.push_back({time, i});
    if (random() % 3 == 0) {
      const auto victim = ids[random() % ids.size()];
      if (queue.cancel(victim.first))
        std::erase_if(expected, [&](const Expected& e) { return e.number == victim.second; });
    }
  }
  std::stable_sort(expected.begin(), expected.end(),
                   [](const Expected& a, const Expected& b) { return a.time < b.time; });
  EXPECT_EQ(queue.pending(), expected.size());
  while (queue.run_next()) {
  }
  ASSERT_EQ(seen.size(), expected.size());
  for (std::size_t i = 0; i < seen.size(); ++i) ASSERT_EQ(seen[i], expected[i].number) << i;
}

}  // namespace
}  // namespace proxarm::fieldbus
