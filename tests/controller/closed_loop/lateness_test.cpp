// Simulated time that keeps pace with a clock waits for a machine that is late: what is told of it, and what it
// changes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "tests/controller/closed_loop/closed_loop_rig.hpp"
#include "tests/controller/closed_loop/replay_network.hpp"

namespace proxarm::controller::testing {
namespace {

constexpr std::int64_t nap_ns = 1'500'000'000;  // when the machine sleeps on, on the network's clock

// The machine is woken 5.5 ms late once, and catches up.
class LateNetwork final : public NetworkAround<BusAround> {
 public:
  using NetworkAround::NetworkAround;
  [[nodiscard]] std::int64_t behind_ns() const noexcept override {
    const std::int64_t since_ns = now_ns() - nap_ns;
    return since_ns < 0 ? 0 : std::max<std::int64_t>(0, 5'500'000 - since_ns);
  }
};

TEST(Lateness, IsCountedByTheCyclesThatEndedAfterTheNextWasDueAndChangesNothing) {
  ClosedLoopRig in_time({}), late({});
  in_time.run();
  LateNetwork network(late.network);
  late.run(network);

  // The clock is at 1.5055 s until simulated time is. Of the cycles from 1.500 s on, those ended late that were to end
  // at 1.501 to 1.505 s.
  EXPECT_EQ(late.tally.overruns, in_time.tally.overruns + 5);
  EXPECT_EQ(late.tally.skipped, 0u);
  EXPECT_EQ(late.fault().fault, Fault::none);
  const auto flagged = [](const ClosedLoopRig& rig) {
    return std::count_if(rig.records.begin(), rig.records.end(),
                         [](const CycleRecord& record) { return record.has(RecordFlag::overrun); });
  };
  EXPECT_EQ(flagged(in_time), 0);
  EXPECT_EQ(flagged(late), 5);
  ASSERT_EQ(late.records.size(), in_time.records.size());
  EXPECT_EQ(late.records.back().tool_W_m, in_time.records.back().tool_W_m);
}

}  // namespace
}  // namespace proxarm::controller::testing
