#include "controller/supervision/alarm.hpp"

#include <gtest/gtest.h>

#include "controller/cycle/past_faults.hpp"

namespace proxarm::controller {
namespace {

TEST(Alarm, DatesWhatItHandsToTheSupervisor) {
  Supervisor supervisor;
  std::uint64_t cycle = 3;
  Alarm alarm(supervisor, cycle);
  cycle = 8;
  alarm.raise(Fault::drive_fault, 2, 1.5, 1.0);
  EXPECT_EQ(supervisor.report().fault, Fault::drive_fault);
  EXPECT_EQ(supervisor.report().cycle, 8u);
  EXPECT_EQ(supervisor.report().where, 2);
  EXPECT_EQ(supervisor.report().value, 1.5);
}

TEST(Alarm, TellsOnceOfAFaultThatHolds) {
  Reactions reactions = reactions_of({});
  reactions[static_cast<std::size_t>(Fault::sensor_late)] = Reaction::hold;
  reactions[static_cast<std::size_t>(Fault::error_passive)] = Reaction::slow;
  Supervisor supervisor(reactions);
  const std::uint64_t cycle = 3;
  Alarm alarm(supervisor, cycle);
  alarm.raise(Fault::error_passive, 0);
  EXPECT_FALSE(alarm.take_hold());
  alarm.raise(Fault::sensor_late);
  EXPECT_TRUE(alarm.take_hold());
  EXPECT_FALSE(alarm.take_hold());
}

TEST(PastFaults, KeepsTheLatestEight) {
  PastFaults faults;
  for (std::uint64_t k = 1; k <= 10; ++k) faults.add({.fault = Fault::drive_fault, .cycle = k});
  EXPECT_EQ(faults.count(), 10u);
  ASSERT_EQ(faults.latest().size(), 8u);
  EXPECT_EQ(faults.latest().front().cycle, 3u);
  EXPECT_EQ(faults.latest().back().cycle, 10u);
}

}  // namespace
}  // namespace proxarm::controller
