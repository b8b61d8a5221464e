#include "controller/cycle/cycle_recorder.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace proxarm::controller {
namespace {

void no_state(fieldbus::StateArchive&) noexcept {}

TEST(CycleRecorder, PassesOneRecordPerCycleThroughTheRing) {
  CycleRecorder recorder(4);
  for (std::uint64_t k = 0; k < 3; ++k) {
    recorder.begin(static_cast<std::int64_t>(k), no_state);
    EXPECT_EQ(recorder.record().flags, 0u) << "a record begins empty";
    recorder.record().cycle = k;
    recorder.record().set(RecordFlag::overrun);
    recorder.finish();
  }
  CycleRecord record;
  for (std::uint64_t k = 0; k < 3; ++k) {
    ASSERT_TRUE(recorder.records().pop(record));
    EXPECT_EQ(record.cycle, k);
  }
  EXPECT_FALSE(recorder.records().pop(record));
}

TEST(CycleRecorder, WithoutABlackBoxNeedsNoState) {
  CycleRecorder recorder(4);
  bool asked = false;
  recorder.begin(0, [&](fieldbus::StateArchive&) noexcept { asked = true; });
  recorder.add_received(0, {});
  recorder.add_status(max_buses, {});
  recorder.finish();
  EXPECT_FALSE(asked);
}

TEST(CycleRecorder, WritesEntryFramesAndStateIntoTheBlackBox) {
  BlackBox box(1e-3, 4);
  CycleRecorder recorder(4);
  recorder.write_to(box);
  std::uint32_t number = 17;
  recorder.begin(5'000, [&](fieldbus::StateArchive& state) noexcept { state(number); });
  recorder.add_received(1, {{.id = 0x181}, 4'000});
  recorder.add_sent(2, {.id = 0x201}, 6'000, fieldbus::SendResult::queue_full);
  recorder.add_status(1, {.state = fieldbus::BusState::error_passive, .receive_overflows = 3});
  recorder.entry().change = {.parameter = Parameter::mass, .value = 5.0};
  recorder.record().cycle = 9;
  recorder.finish();

  BoxCycle entry;
  std::vector<BoxFrame> frames;
  ASSERT_TRUE(box.read(0, entry, frames));
  EXPECT_EQ(entry.t_k_ns, 5'000);
  EXPECT_EQ(entry.record.cycle, 9u);
  EXPECT_EQ(entry.change.value, 5.0);
  EXPECT_EQ(entry.buses[1].receive_overflows, 3u);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].frame.id, 0x181u);
  EXPECT_FALSE(frames[0].sent);
  EXPECT_TRUE(frames[1].sent);
  EXPECT_EQ(frames[1].result, fieldbus::SendResult::queue_full);
  std::uint64_t cycle = 1;
  std::vector<std::byte> state;
  ASSERT_TRUE(box.oldest_state(cycle, state));
  EXPECT_EQ(cycle, 0u);
  EXPECT_EQ(state.size(), sizeof number);
}

// The box' entries are a ring of ten seconds. One that was used again kept the command and the timestep of the cycle
// ten seconds before, and a replay gave them a second time.
TEST(CycleRecorder, ForgetsWhatTheReusedEntryWasAskedFor) {
  BlackBox box(0.1, 1);  // few cycles are ten seconds of it
  CycleRecorder recorder(2);
  recorder.write_to(box);
  BoxCycle entry;
  std::vector<BoxFrame> frames;
  for (std::uint64_t k = 0; k < 2'000; ++k) {
    recorder.begin(static_cast<std::int64_t>(k), no_state);
    if (k < 100) {
      recorder.entry().change.parameter = Parameter::mass;
      recorder.entry().command.order = Order::hold;
      recorder.entry().timestep.period_s = 2e-3;
    }
    recorder.finish();
    if (k < 100) continue;
    ASSERT_TRUE(box.read(k, entry, frames));
    ASSERT_EQ(entry.change.parameter, Parameter::none) << k;
    ASSERT_EQ(entry.command.order, Order::none) << k;
    ASSERT_EQ(entry.timestep.period_s, 0.0) << k;
  }
}

}  // namespace
}  // namespace proxarm::controller
