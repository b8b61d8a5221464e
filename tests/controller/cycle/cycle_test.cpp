// The parts of the cycle together: what is archived of it is all of it.
#include "controller/cycle/cycle.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/controller/closed_loop/closed_loop_rig.hpp"

namespace proxarm::controller {
namespace {

using testing::ClosedLoopRig;
using testing::RigOptions;

std::vector<std::byte> archived(Cycle& cycle) {
  std::vector<std::byte> bytes(BlackBox::most_state_bytes);
  fieldbus::StateArchive state = fieldbus::StateArchive::writer(bytes);
  cycle.archive(state);
  EXPECT_TRUE(state.whole()) << "the black box has room for it";
  bytes.resize(state.bytes());
  return bytes;
}

void expect_same_after_reading(const RigOptions& options) {
  ClosedLoopRig rig(options);
  rig.run();
  const std::vector<std::byte> then = archived(*rig.cycle);
  ClosedLoopRig other(options);
  Cycle fresh(other.prepared_parts(other.network), options.settings, other.cell.limits, 64);
  EXPECT_NE(archived(fresh), then);
  fieldbus::StateArchive reader = fieldbus::StateArchive::reader(then);
  fresh.archive(reader);
  EXPECT_TRUE(reader.whole());
  EXPECT_EQ(reader.bytes(), then.size());
  EXPECT_EQ(archived(fresh), then);
}

TEST(Cycle, IsTheSameAfterItsStateWasWrittenAndRead) { expect_same_after_reading({.duration_s = 1.5}); }

TEST(Cycle, IsTheSameAfterItsStateWasReadInAnotherTimestep) {
  RigOptions options{.duration_s = 1.5};
  options.settings.passivity = Passivity::on;
  const Timestep to{.period_s = 2e-3, .max_missed_samples = 3, .max_repeated_samples = 20};
  options.timesteps = {{500'000'000, to}};
  expect_same_after_reading(options);
}

TEST(Cycle, IsTheSameAfterItsStateWasReadInTheImpedanceType) {
  RigOptions options{.duration_s = 1.0, .cell = "models/cells/light.yaml"};
  options.settings.scheme = Scheme::impedance;
  expect_same_after_reading(options);
}

}  // namespace
}  // namespace proxarm::controller
