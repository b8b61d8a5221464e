#include "controller/cycle/fault_monitor.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/controller/motion/fake_devices.hpp"

namespace proxarm::controller {
namespace {

using testing::FakeDrives;
using testing::FakeSensor;
using testing::Watched;

struct FaultMonitorTest : ::testing::Test {
  FaultMonitorTest() {
    watched.bring_to_rendering();
    measurement.take();
  }
  // One cycle, as it is now.
  void judge(bool telling = false) {
    ++watched.cycle;
    measurement.take();
    monitor.judge_encoders(measurement.now(), Phase::rendering);
    monitor.judge({.measured = measurement.now(),
                   .sample = sensor.sample,
                   .buses = buses,
                   .overruns_in_a_row = overruns,
                   .telling = telling});
  }
  [[nodiscard]] Fault stopped_for() const { return watched.supervisor.report().fault; }

  description::Cell cell = testing::default_cell();
  models::Arm arm{cell};
  FakeDrives drives{cell, arm};
  FakeSensor sensor;
  SessionSettings settings;
  Watched watched;
  std::vector<fieldbus::BusStatus> buses = std::vector<fieldbus::BusStatus>(3);
  std::uint32_t overruns = 0;
  Measurement measurement{drives.on_bus, sensor, arm, WrenchCompensation(cell), settings.period_s};
  FaultMonitor monitor{drives.on_bus, settings, {200.0, 0.5, 0.025}, watched.supervisor, watched.alarm};
};

TEST_F(FaultMonitorTest, FindsNothingWrongWithDevicesThatAreWell) {
  for (int k = 0; k < 100; ++k) judge();
  EXPECT_EQ(watched.supervisor.phase(), Phase::rendering);
  EXPECT_EQ(stopped_for(), Fault::none);
}

TEST_F(FaultMonitorTest, MissesASampleForAsLongAsItMayBe) {
  sensor.is_fresh = false;
  for (std::uint32_t k = 0; k < settings.max_missed_samples; ++k) judge();
  EXPECT_EQ(stopped_for(), Fault::none);
  judge();
  EXPECT_EQ(watched.times(Fault::sensor_lost), 1u);
}

// A person who was pinned pressed a gauge to its rail in a hold, and after a tenth of a second the drives were switched
// off: session 16 of RandomSessions.
TEST_F(FaultMonitorTest, TakesAGaugeAtItsRailForNoStuckChannel) {
  watched.supervisor.hold();
  sensor.sample.saturated = true;
  sensor.sample.channel_repeats = 500;
  judge();
  EXPECT_EQ(stopped_for(), Fault::none);
  sensor.sample.saturated = false;
  judge();
  EXPECT_EQ(stopped_for(), Fault::sensor_frozen);
}

TEST_F(FaultMonitorTest, FindsSamplesLateThatAreMissedAgainAndAgain) {
  for (int k = 0; k < 200 && watched.times(Fault::sensor_late) == 0; ++k) {
    sensor.is_fresh = k % 10 != 0;
    judge();
  }
  EXPECT_EQ(watched.times(Fault::sensor_late), 1u);
}

TEST_F(FaultMonitorTest, LetsOneSampleIn17BeLate) {
  for (int k = 0; k < 1700; ++k) {
    sensor.is_fresh = k % 17 != 0;
    judge();
  }
  EXPECT_EQ(watched.times(Fault::sensor_late), 0u);
}

TEST_F(FaultMonitorTest, ReadsTheSensorsOwnWords) {
  sensor.sample.healthy = false;
  judge();
  EXPECT_EQ(watched.times(Fault::sensor_status), 1u);
}

TEST_F(FaultMonitorTest, RefusesAForceThatIsNone) {
  sensor.sample.wrench_S[4] = std::numeric_limits<double>::quiet_NaN();
  judge();
  EXPECT_EQ(watched.times(Fault::force_not_finite), 1u);
}

TEST_F(FaultMonitorTest, RefusesAForceBeyondTheCells) {
  sensor.sample.wrench_S[0] = 300.0;
  judge();
  EXPECT_EQ(watched.times(Fault::force_excessive), 1u);
}

TEST_F(FaultMonitorTest, NeedsNoForceInAHold) {
  watched.supervisor.hold();
  sensor.sample.saturated = true;
  judge();
  EXPECT_EQ(watched.times(Fault::sensor_saturated), 0u);
  watched.supervisor.handle(Event::resume);
  judge();
  EXPECT_EQ(watched.times(Fault::sensor_saturated), 1u);
}

TEST_F(FaultMonitorTest, FindsAFrozenSensor) {
  sensor.sample.repeats = settings.max_repeated_samples;
  judge();
  EXPECT_EQ(watched.times(Fault::sensor_frozen), 0u);
  sensor.sample.repeats++;
  judge();
  EXPECT_EQ(watched.times(Fault::sensor_frozen), 1u);
}

TEST_F(FaultMonitorTest, TellsALateDriveFromASilentOne) {
  drives[1].is_fresh = false;
  judge(true);
  EXPECT_EQ(watched.times(Fault::feedback_late), 0u) << "an SDO answer may hold it up";
  judge();
  EXPECT_EQ(watched.times(Fault::feedback_late), 1u);
  drives[1].silent_cycles = settings.max_missed_feedback + 1;
  judge();
  EXPECT_EQ(watched.times(Fault::drive_silent), 1u);
  EXPECT_EQ(watched.supervisor.report().where, 1);
}

TEST_F(FaultMonitorTest, NamesWhatADriveReports) {
  const std::pair<fieldbus::DriveFault, Fault> table[]{
      {fieldbus::DriveFault::left_operation, Fault::drive_disabled},
      {fieldbus::DriveFault::modbus_closed, Fault::modbus_silent},
      {fieldbus::DriveFault::target_out_of_range, Fault::target_out_of_range},
      {fieldbus::DriveFault::emergency, Fault::drive_fault}};
  for (const auto& [of_drive, fault] : table) {
    watched.supervisor = Supervisor();
    watched.bring_to_rendering();
    drives[4].its_fault = of_drive;
    judge();
    EXPECT_EQ(watched.times(fault), 1u) << fault_name(fault);
  }
}

TEST_F(FaultMonitorTest, FindsAnEncoderThatJumpsFurtherThanItsJointCan) {
  const double per_cycle_rad = drives[0].own.max_speed_rad_per_s * settings.period_s;
  drives[0].angle_rad += 3.9 * per_cycle_rad;
  judge();
  EXPECT_EQ(stopped_for(), Fault::none);
  drives[0].angle_rad += 4.1 * per_cycle_rad;
  judge();
  EXPECT_EQ(stopped_for(), Fault::position_implausible);
}

TEST_F(FaultMonitorTest, LetsAnEncoderThatWasSilentCatchUp) {
  const double per_cycle_rad = drives[0].own.max_speed_rad_per_s * settings.period_s;
  drives[0].is_fresh = false;
  judge();
  drives[0].is_fresh = true;
  drives[0].angle_rad += 7.9 * per_cycle_rad;
  judge();
  EXPECT_EQ(watched.times(Fault::position_implausible), 0u);
}

// Nodes that are swapped and offsets that are wrong, told before a drive has power.
TEST_F(FaultMonitorTest, FindsAJointThatStandsOutOfItsRangeBeforeTheFirstEnabling) {
  watched.supervisor = Supervisor();
  watched.supervisor.handle(Event::begin);
  const auto [low, high] = drives[2].own.range_rad;
  const auto found_at = [&](double angle_rad, bool tared, bool fresh = true) {
    watched.supervisor = Supervisor();
    watched.supervisor.handle(Event::begin);
    drives[2].angle_rad = angle_rad;
    drives[2].is_fresh = true;
    measurement.take();
    drives[2].is_fresh = fresh;
    measurement.take();
    monitor.judge({.measured = measurement.now(), .sample = sensor.sample, .buses = buses, .tared = tared});
    return stopped_for();
  };
  for (const double beyond : {0.0249, -0.0249}) {
    const double end = beyond > 0.0 ? high : low;
    EXPECT_EQ(found_at(end + beyond, false), Fault::none);
    EXPECT_EQ(found_at(end + 1.01 * beyond, false), Fault::joint_out_of_range);
    EXPECT_EQ(watched.supervisor.report().where, 2);
    EXPECT_EQ(watched.supervisor.report().limit, end);
    EXPECT_EQ(found_at(end + 1.01 * beyond, true), Fault::none) << "it may be led back";
    EXPECT_EQ(found_at(end + 1.01 * beyond, false, false), Fault::none) << "before it has said anything";
  }
}

struct FollowingTest : FaultMonitorTest {
  FollowingTest() {
    for (std::size_t i = 0; i < 6; ++i) drives[i].angle_rad = drives[i].told_rad;
    measurement.take();
    for (int k = 0; k < 50; ++k) judge_following(Phase::rendering);
  }
  void judge_following(Phase entered) {
    ++watched.cycle;
    measurement.take();
    following.judge_encoders(measurement.now(), entered);
  }
  FaultMonitor following{drives.on_bus,
                         settings,
                         {200.0, 0.5},
                         watched.supervisor,
                         watched.alarm,
                         std::nullopt,
                         DriveMonitor(arm, cell.drives, cell.limits.following_error_rad)};
};

TEST_F(FollowingTest, SwitchesADriveOffThatGoesWhereNobodySentIt) {
  for (int k = 0; k < 40; ++k) {
    drives[2].angle_rad += 1e-4;
    judge_following(Phase::holding);
  }
  EXPECT_EQ(stopped_for(), Fault::drive_deviates);
  EXPECT_EQ(watched.supervisor.report().where, 2);
  EXPECT_EQ(watched.supervisor.report().reaction, Reaction::stop_0);
  EXPECT_EQ(watched.supervisor.phase(), Phase::disabling);
}

TEST_F(FollowingTest, HoldsTheArmForADriveThatDoesNotComeToItsSetpoint) {
  drives[3].told_rad += 1e-3;
  for (int k = 0; k < 480; ++k) judge_following(Phase::rendering);
  EXPECT_EQ(watched.supervisor.phase(), Phase::rendering);
  for (int k = 0; k < 40; ++k) judge_following(Phase::rendering);
  EXPECT_EQ(watched.supervisor.phase(), Phase::holding);
  EXPECT_EQ(watched.times(Fault::drive_blocked), 1u);
  for (int k = 0; k < 2'000; ++k) judge_following(Phase::holding);
  EXPECT_EQ(watched.times(Fault::drive_blocked), 1u) << "in the hold no setpoint waits";
}

TEST_F(FollowingTest, LetsAnArmThatIsOffBeMoved) {
  drives[2].its_state = fieldbus::DriveState::switched_on;
  drives[2].follows = false;
  for (const Phase phase : {Phase::idle, Phase::enabling, Phase::disabling, Phase::faulted}) {
    drives[2].angle_rad += 0.01;
    judge_following(phase);
  }
  EXPECT_EQ(stopped_for(), Fault::none);
}

// Before it takes setpoints, while it brakes by itself, and until it says that it is off.
TEST_F(FollowingTest, JudgesADriveThatHasPowerAndTakesNoSetpoints) {
  using enum fieldbus::DriveState;
  for (const auto& [phase, state] :
       {std::pair{Phase::enabling, operation_enabled}, std::pair{Phase::stopping, quick_stop_active},
        std::pair{Phase::stopping, fault_reaction_active}, std::pair{Phase::disabling, operation_enabled}}) {
    SCOPED_TRACE(phase_name(phase));
    watched.supervisor = Supervisor();
    watched.bring_to_rendering();
    drives[2].its_state = state;
    drives[2].follows = false;
    judge_following(phase);
    for (int k = 0; k < 40; ++k) {
      drives[2].angle_rad += 2e-4;
      judge_following(phase);
    }
    EXPECT_EQ(stopped_for(), Fault::drive_deviates);
    drives[2].its_state = switched_on;
    judge_following(phase);
  }
}

TEST_F(FollowingTest, JudgesNoDriveWhosePowerWasCut) {
  watched.supervisor.raise({Fault::tool_too_fast, -1, 1});
  ASSERT_EQ(watched.supervisor.phase(), Phase::disabling);
  for (int k = 0; k < 40; ++k) {
    drives[2].angle_rad += 0.01;
    judge_following(Phase::disabling);
  }
  EXPECT_EQ(watched.times(Fault::drive_deviates), 0u);
}

TEST_F(FaultMonitorTest, JudgesTheEncodersOfDrivesThatAreNotOffYet) {
  for (const Event event : {Event::stop, Event::at_rest}) watched.supervisor.handle(event);
  drives[0].its_state = fieldbus::DriveState::ready_to_switch_on;
  drives[0].angle_rad += 1.0;
  drives[1].angle_rad += 1.0;
  measurement.take();
  monitor.judge_encoders(measurement.now(), Phase::disabling);
  EXPECT_EQ(watched.times(Fault::position_implausible), 1u);
  EXPECT_EQ(watched.supervisor.report().where, 1);
  EXPECT_TRUE(watched.supervisor.cuts_power());
}

// One that fell into its fault while the others are switched off; not one that was in it before.
TEST_F(FaultMonitorTest, FindsADriveThatReportsAFaultWhileItIsSwitchedOff) {
  drives[3].its_state = fieldbus::DriveState::fault;
  judge();
  for (const Event event : {Event::stop, Event::at_rest}) watched.supervisor.handle(event);
  judge();
  EXPECT_EQ(stopped_for(), Fault::none);
  drives[4].its_state = fieldbus::DriveState::fault_reaction_active;
  judge();
  EXPECT_EQ(stopped_for(), Fault::drive_fault);
  EXPECT_EQ(watched.supervisor.report().where, 4);
  EXPECT_TRUE(watched.supervisor.cuts_power());
}

TEST_F(FaultMonitorTest, JudgesNoEncoderOfAnArmThatIsFree) {
  drives[0].angle_rad += 1.0;
  measurement.take();
  monitor.judge_encoders(measurement.now(), Phase::enabling);
  EXPECT_EQ(stopped_for(), Fault::none);
}

TEST_F(FaultMonitorTest, FindsABusThatIsGone) {
  const std::pair<fieldbus::BusState, Fault> table[]{{fieldbus::BusState::error_passive, Fault::error_passive},
                                                     {fieldbus::BusState::down, Fault::interface_down},
                                                     {fieldbus::BusState::bus_off, Fault::bus_off}};
  for (const auto& [state, fault] : table) {
    buses[2].state = state;
    judge();
    EXPECT_EQ(watched.times(fault), 1u) << fault_name(fault);
  }
}

TEST_F(FaultMonitorTest, CountsLostFramesFromTheResetOn) {
  buses[1].receive_overflows = 3;
  monitor.forget(buses);
  judge();
  EXPECT_EQ(watched.times(Fault::receive_overflow), 0u);
  buses[1].receive_overflows = 5;
  judge();
  EXPECT_EQ(watched.times(Fault::receive_overflow), 1u);
}

TEST_F(FaultMonitorTest, StopsForALoopThatIsLateTooOften) {
  overruns = settings.max_overruns;
  judge();
  EXPECT_EQ(stopped_for(), Fault::none);
  ++overruns;
  judge();
  EXPECT_EQ(stopped_for(), Fault::overrun);
}

}  // namespace
}  // namespace proxarm::controller
