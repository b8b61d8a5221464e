#include "controller/cycle/timestep_change.hpp"

#include <gtest/gtest.h>

#include "tests/controller/motion/fake_devices.hpp"

namespace proxarm::controller {
namespace {

using testing::Watched;

constexpr Timestep one_ms{.period_s = 1e-3, .max_missed_samples = 3, .max_repeated_samples = 20};
constexpr Timestep two_ms{.period_s = 2e-3, .max_missed_samples = 2, .max_repeated_samples = 10};
constexpr TimestepChange::Surroundings at_rest{.held = true, .stands = true};

fieldbus::ServoDrive default_drive() {
  const description::Cell cell = testing::default_cell();
  return fieldbus::ServoDrive(cell.drives[0], {});
}

struct TimestepChangeTest : ::testing::Test {
  TimestepChange::Step step(const TimestepChange::Surroundings& surroundings = at_rest) {
    t_k_ns += 1'000'000;
    record = {};
    return change.step(t_k_ns, surroundings, watched.alarm, record);
  }
  // As long as the arm must stand.
  void come_to_rest() {
    for (int k = 0; k < 3; ++k) {
      EXPECT_FALSE(step().now);
      EXPECT_FALSE(change.telling());
    }
  }
  // The drive refuses the request that is due.
  void refuse() {
    fieldbus::CanFrame frame;
    std::size_t bus = 9;
    ASSERT_TRUE(change.next_request(t_k_ns, bus, frame));
    EXPECT_EQ(bus, 0u);
    fieldbus::CanFrame answer{.id = 0x580u + drive.node(), .length = 8};
    answer.data = {0x80, frame.data[1], frame.data[2], frame.data[3], 0x22, 0x00, 0x00, 0x08};
    EXPECT_TRUE(change.on_frame(0, answer));
  }

  Watched watched;
  fieldbus::ServoDrive drive = default_drive();
  std::vector<fieldbus::DriveSlot> slots{{&drive, 0}};
  TimestepChange of_no_drive{{}};
  TimestepChange change{slots};
  CycleRecord record;
  std::int64_t t_k_ns = 0;
};

TEST_F(TimestepChangeTest, DoesNothingUnasked) {
  EXPECT_FALSE(change.under_way());
  EXPECT_TRUE(change.settled());
  EXPECT_FALSE(step().now);
  EXPECT_FALSE(change.on_frame(0, {.id = 0x581}));
}

TEST_F(TimestepChangeTest, WaitsUntilTheArmHasStoodForThreeCycles) {
  change.begin(one_ms, two_ms, true, watched.alarm);
  EXPECT_TRUE(change.under_way());
  for (int k = 0; k < 10; ++k) (void)step({.held = true, .stands = false});
  come_to_rest();
  change.wait_again();
  come_to_rest();
  (void)step();
  EXPECT_TRUE(change.telling());
}

TEST_F(TimestepChangeTest, AppliesAShorterPeriodBeforeTheDrivesAreToldAndALongerOneAfter) {
  change.begin(two_ms, one_ms, false, watched.alarm);
  come_to_rest();
  const TimestepChange::Step begun = step();
  ASSERT_TRUE(begun.now);
  EXPECT_EQ(begun.now->period_s, 1e-3);
  EXPECT_TRUE(change.telling());

  of_no_drive.begin(one_ms, two_ms, true, watched.alarm);
  for (int k = 0; k < 4; ++k) {
    EXPECT_FALSE(of_no_drive.step(0, at_rest, watched.alarm, record).now);
  }
  const TimestepChange::Step ended = of_no_drive.step(0, at_rest, watched.alarm, record);
  ASSERT_TRUE(ended.now);
  EXPECT_EQ(ended.now->max_missed_samples, 2u);
  EXPECT_TRUE(ended.resumes);
  EXPECT_FALSE(of_no_drive.under_way());
}

TEST_F(TimestepChangeTest, IsGivenUpWhereTheHoldEndsBeforeAnybodyWasTold) {
  change.begin(one_ms, two_ms, true, watched.alarm);
  const TimestepChange::Step ended = step({.held = false});
  EXPECT_FALSE(ended.now);
  EXPECT_FALSE(change.under_way());
  EXPECT_EQ(record.refused_period_ns, 2'000'000);
  EXPECT_EQ(record.timestep_refusal.drive, -1);
}

TEST_F(TimestepChangeTest, IsTakenBackWhereADriveRefuses) {
  change.begin(one_ms, two_ms, true, watched.alarm);
  come_to_rest();
  (void)step();
  refuse();
  (void)step();
  EXPECT_EQ(record.refused_period_ns, 2'000'000);
  EXPECT_EQ(record.timestep_refusal.drive, 0);
  EXPECT_EQ(record.timestep_refusal.index, 0x60C2);
  EXPECT_TRUE(change.telling()) << "it is asked what it has";
}

TEST_F(TimestepChangeTest, StaysInAHoldThatAFaultBeganMeanwhile) {
  Reactions reactions = reactions_of({});
  reactions[static_cast<std::size_t>(Fault::sensor_late)] = Reaction::hold;
  watched.supervisor = Supervisor(reactions);
  watched.alarm.raise(Fault::sensor_late);
  of_no_drive.begin(one_ms, two_ms, true, watched.alarm);
  for (int k = 0; k < 4; ++k) (void)of_no_drive.step(0, at_rest, watched.alarm, record);
  EXPECT_TRUE(of_no_drive.step(0, at_rest, watched.alarm, record).resumes) << "that fault came before";

  of_no_drive.begin(one_ms, two_ms, true, watched.alarm);
  watched.alarm.raise(Fault::sensor_late);
  for (int k = 0; k < 4; ++k) (void)of_no_drive.step(0, at_rest, watched.alarm, record);
  const TimestepChange::Step ended = of_no_drive.step(0, at_rest, watched.alarm, record);
  EXPECT_TRUE(ended.now);
  EXPECT_FALSE(ended.resumes);
}

}  // namespace
}  // namespace proxarm::controller
