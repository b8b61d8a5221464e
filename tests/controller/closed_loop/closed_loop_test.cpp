// Controller against the simulated arm while something fails in the middle of a motion: the right fault, soon, and the
// arm comes to rest in a controlled way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "models/base/setup_error.hpp"
#include "tests/controller/closed_loop/closed_loop_stop.hpp"

namespace proxarm::controller {
namespace {

using testing::at_rest_m_per_s;
using testing::ClosedLoopRig;
using testing::expect_arm_at_rest;
using testing::expect_controlled_stop;
using testing::expect_drives_off;
using testing::expect_targets_run_out;
using testing::failure_ns;
using testing::failure_s;
using testing::RigOptions;

RigOptions failing_device(const std::string& fault) { return {.device_faults = {fault + "@1.9s"}}; }

TEST(ClosedLoop, WithoutAFaultRunsToItsEndAndSwitchesOff) {
  ClosedLoopRig rig({});
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  EXPECT_EQ(rig.cycle->supervisor().phase(), Phase::done);
  EXPECT_EQ(rig.cycle->rendered_cycles(), 2500u);
  expect_drives_off(rig);
}

// Missed are 3 samples, which are tolerated, and then one more.
TEST(ClosedLoop, StopsInFourCyclesWhenTheSensorIsLost) {
  for (const char* fault : {"sensor:silent", "sensor:samples", "sensor:half", "sensor:short", "sensor:swapped"}) {
    SCOPED_TRACE(fault);
    ClosedLoopRig rig(failing_device(fault));
    rig.run();
    expect_controlled_stop(rig, Fault::sensor_lost, -1, 4);
  }
}

// Each frame twice: what comes again is no new sample, and nothing is wrong with the first.
TEST(ClosedLoop, RidesThroughDuplicatedFrames) {
  ClosedLoopRig rig(failing_device("sensor:duplicated"));
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  EXPECT_EQ(rig.cycle->rendered_cycles(), 2500u);
}

TEST(ClosedLoop, RidesThroughThreeMissedSamples) {
  ClosedLoopRig rig({.device_faults = {"sensor:samples@1.9s..1.903s"}});
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  EXPECT_EQ(std::count_if(rig.records.begin(), rig.records.end(),
                          [](const CycleRecord& r) { return r.has(RecordFlag::sample_held); }),
            3);
}

// 20 repeats are tolerated; the sample before the first of them was a fresh one.
TEST(ClosedLoop, StopsInTwentyTwoCyclesWhenTheSensorFreezes) {
  ClosedLoopRig rig(failing_device("sensor:frozen"));
  rig.run();
  expect_controlled_stop(rig, Fault::sensor_frozen, -1, 22);
}

TEST(ClosedLoop, StopsAtOnceWhenTheSensorReportsAnError) {
  ClosedLoopRig rig(failing_device("sensor:status=0x4000"));
  rig.run();
  expect_controlled_stop(rig, Fault::sensor_status, -1, 1);
}

// At rest, gauge 0 stands 150 counts (some 3 N) from one of its rails: the push against the wall takes it to one of
// them.
TEST(ClosedLoop, StopsWhenAGaugeComesToItsRail) {
  RigOptions options;
  const int at_rest = ClosedLoopRig(options).far_end.plant().force_sensor().sample(0).gauges[0];
  options.duration_s = 7.0;
  int saturated = 0;
  for (const int wanted : {32767 - 150, -32767 + 150}) {
    options.sensor_bias_counts[0] = wanted - at_rest;
    ClosedLoopRig rig(options);
    rig.run();
    if (rig.fault().fault == Fault::none) continue;
    ++saturated;
    EXPECT_EQ(fault_name(rig.fault().fault), std::string("sensor_saturated"));
    expect_arm_at_rest(rig, 0.01);
    expect_drives_off(rig);
  }
  EXPECT_GE(saturated, 1);
}

TEST(ClosedLoop, StopsTheOthersWhenADriveTrips) {
  for (const std::int32_t axis : {0, 2, 4}) {
    SCOPED_TRACE(axis);
    ClosedLoopRig rig(failing_device("axis_" + std::to_string(axis + 1) + ":fault=0x4210"));
    rig.run();
    expect_controlled_stop(rig, Fault::drive_fault, axis, 2);
  }
}

TEST(ClosedLoop, StopsTheOthersWhenADriveFallsSilent) {
  for (const char* kind : {":silent", ":power"}) {
    SCOPED_TRACE(kind);
    ClosedLoopRig rig(failing_device(std::string("axis_2") + kind));
    rig.run();
    expect_controlled_stop(rig, Fault::drive_silent, 1, 4);
  }
}

// Nothing can be sent on that bus any more; the drives there stop by themselves when the controller's RPDOs stay away.
TEST(ClosedLoop, StopsTheOtherBusAtOnceWhenACableIsCut) {
  RigOptions options{
      .script = {{{.action = fieldbus::FaultAction::bus_off, .bus = "axes_1_3", .from_ns = failure_ns}}}};
  ClosedLoopRig rig(options);
  rig.run();
  expect_controlled_stop(rig, Fault::bus_off, 0, 1);
}

TEST(ClosedLoop, StopsTheOtherBusAtOnceWhenAnInterfaceGoesDown) {
  ClosedLoopRig rig(
      {.script = {{{.action = fieldbus::FaultAction::port_down, .bus = "axes_4_6", .from_ns = failure_ns}}}});
  rig.run();
  EXPECT_NE(rig.fault().fault, Fault::none);
  EXPECT_LE(rig.fault().cycle, rig.cycle_at(failure_s) + 1);
  expect_targets_run_out(rig);
  expect_arm_at_rest(rig, 0.01);
}

// The bus still works, but the next errors would end it.
// By the cell's choice: without one, the arm slows down.
TEST(ClosedLoop, StopsAtOnceWhenABusIsErrorPassive) {
  RigOptions options{
      .script = {{{.action = fieldbus::FaultAction::error_passive, .bus = "axes_1_3", .from_ns = failure_ns}}}};
  options.edit_cell = [](description::Cell& cell) { cell.supervision.reactions = {{"error_passive", "stop_1"}}; };
  ClosedLoopRig rig(options);
  rig.run();
  expect_controlled_stop(rig, Fault::error_passive, 0, 1);
}

// TPDO1 of node 2 with 4 bytes instead of 6: statusword and half a position.
TEST(ClosedLoop, StopsWhenATpdoIsShort) {
  ClosedLoopRig rig({.script = {{{.action = fieldbus::FaultAction::resize,
                                  .bus = "axes_1_3",
                                  .id = 0x182,
                                  .mask = 0x7FF,
                                  .from_ns = failure_ns,
                                  .receiver = "controller",
                                  .length = 4}}}});
  rig.run();
  expect_controlled_stop(rig, Fault::drive_fault, 1, 2);
  EXPECT_EQ(rig.cycle->parts().drives[1].drive.fault(), fieldbus::DriveFault::pdo_short);
}

// One TPDO later than its cycle counts as missed, and three in a row are tolerated.
TEST(ClosedLoop, RidesThroughThreeLateTpdos) {
  ClosedLoopRig rig({.script = {{{.action = fieldbus::FaultAction::delay,
                                  .bus = "axes_4_6",
                                  .id = 0x185,
                                  .mask = 0x7FF,
                                  .from_ns = failure_ns,
                                  .count = 3,
                                  .receiver = "controller",
                                  .delay_ns = 700'000}}}});
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
}

// A node that never yields: nothing of ours gets through, ten frames wait, and the eleventh is refused (ENOBUFS).
TEST(ClosedLoop, StopsTheOtherBusWhenTheQueueIsFull) {
  fieldbus::CanFrame urgent;
  urgent.id = 0x010;
  urgent.length = 8;
  ClosedLoopRig rig({.script = {{{.action = fieldbus::FaultAction::babble,
                                  .bus = "axes_4_6",
                                  .from_ns = failure_ns,
                                  .to_ns = failure_ns + 300'000'000,
                                  .frame = urgent,
                                  .period_ns = 100'000}}}});
  rig.run();
  EXPECT_TRUE(rig.fault().fault == Fault::send_failed || rig.fault().fault == Fault::drive_silent)
      << fault_name(rig.fault().fault);
  EXPECT_LE(rig.fault().cycle, rig.cycle_at(failure_s) + 4);
  expect_arm_at_rest(rig, 0.01);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NE(rig.far_end.drive(axis).state(), sim::DriveState::operation_enabled) << "the bus that still works";
  }
}

// Set-up ends with the node and the object that went unanswered; nothing has moved.
TEST(ClosedLoop, IsRefusedWhenADriveDoesNotAnswerItsSdo) {
  ClosedLoopRig rig({.device_faults = {"axis_2:sdo"}});
  try {
    rig.run();
    FAIL();
  } catch (const description::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("no answer"), std::string::npos) << error.what();
    EXPECT_EQ(error.problem().node, 2);
  }
}

TEST(ClosedLoop, IsRefusedWhenAnotherDeviceHasADrivesNode) {
  ClosedLoopRig rig({.device_faults = {"axis_5:device_type=0x00030191"}});
  try {
    rig.run();
    FAIL();
  } catch (const description::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("device type"), std::string::npos) << error.what();
    EXPECT_EQ(error.problem().node, 5);
  }
}

// Somebody's EMCY in the name of node 5, which itself feels fine: 4210h, excess temperature.
TEST(ClosedLoop, StopsWhenADriveSendsAnEmergencyMessage) {
  fieldbus::CanFrame emergency;
  emergency.id = 0x085;
  emergency.length = 8;
  emergency.data = {0x10, 0x42, 0x09};
  ClosedLoopRig rig({.script = {{{.action = fieldbus::FaultAction::babble,
                                  .bus = "axes_4_6",
                                  .from_ns = failure_ns,
                                  .to_ns = failure_ns + 1,
                                  .frame = emergency,
                                  .period_ns = 1'000'000'000}}}});
  rig.run();
  expect_controlled_stop(rig, Fault::drive_fault, 4, 2);
}

// At set-up a drive's heartbeat is the only word on its NMT state.
TEST(ClosedLoop, IsRefusedWhenADrivesHeartbeatStaysAway) {
  ClosedLoopRig rig({.device_faults = {"axis_2:heartbeat"}});
  try {
    rig.run();
    FAIL();
  } catch (const description::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("NMT state in its heartbeat"), std::string::npos) << error.what();
    EXPECT_EQ(error.problem().node, 2);
  }
}

// From then on a TPDO at every SYNC says the same, fifty times as often: heartbeats are switched off. What is lost with
// the drive is the TPDO (StopsTheOthersWhenADriveFallsSilent).
TEST(ClosedLoop, HasNoHeartbeatsOfDrivesToLoseInOperation) {
  ClosedLoopRig rig(failing_device("axis_2:heartbeat"));
  int heartbeats = 0;
  rig.network.set_observer([&](const fieldbus::WireFrame& wire) {
    if (wire.end_ns > failure_ns && wire.frame.id >= 0x701 && wire.frame.id <= 0x706) ++heartbeats;
  });
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  EXPECT_EQ(heartbeats, 0);
}

// Somebody else takes node 2 out of operational (80h) or resets it (81h): his frame is seen before its effect.
TEST(ClosedLoop, StopsWhenSomebodyElseResetsADrive) {
  for (const std::uint8_t command : {std::uint8_t{0x80}, std::uint8_t{0x81}}) {
    SCOPED_TRACE(int{command});
    fieldbus::CanFrame nmt;
    nmt.id = 0x000;
    nmt.length = 2;
    nmt.data = {command, 0x02};
    ClosedLoopRig rig({.script = {{{.action = fieldbus::FaultAction::babble,
                                    .bus = "axes_1_3",
                                    .from_ns = failure_ns,
                                    .to_ns = failure_ns + 1,
                                    .frame = nmt,
                                    .period_ns = 1'000'000'000}}}});
    rig.run();
    ASSERT_EQ(rig.fault().fault, Fault::second_master) << fault_name(rig.fault().fault);
    EXPECT_EQ(rig.fault().where, 0) << "the bus";
    EXPECT_LE(rig.fault().cycle, rig.cycle_at(failure_s) + 2);
    expect_targets_run_out(rig, {1});
    expect_arm_at_rest(rig, 0.02);
    expect_drives_off(rig);
  }
}

// Somebody else switches a drive off: shutdown (0006h) in an RPDO for node 3, right after ours.
TEST(ClosedLoop, StopsTheOthersWhenADriveLeavesOperation) {
  fieldbus::CanFrame shutdown;
  shutdown.id = 0x203;
  shutdown.length = 2;
  shutdown.data = {0x06, 0x00};
  ClosedLoopRig rig({.script = {{{.action = fieldbus::FaultAction::babble,
                                  .bus = "axes_1_3",
                                  .from_ns = failure_ns + 900'000,
                                  .to_ns = failure_ns + 20'000'000,
                                  .frame = shutdown,
                                  .period_ns = 1'000'000}}}});
  rig.run();
  ASSERT_EQ(rig.fault().fault, Fault::second_master) << fault_name(rig.fault().fault);
  EXPECT_EQ(rig.fault().where, 0) << "the bus";
  EXPECT_LE(rig.fault().cycle, rig.cycle_at(failure_s) + 2);
  expect_targets_run_out(rig, {2});
  expect_arm_at_rest(rig, 0.02);
  expect_drives_off(rig);
}

// One frame of another controller is enough, whatever it says: SYNC, an NMT command for a node that isn't ours, the
// heartbeat of the controller's own node.
TEST(ClosedLoop, StopsInTwoCyclesWhenASecondMasterSpeaks) {
  for (const std::uint32_t id : {0x080U, 0x000U, 0x77FU}) {
    SCOPED_TRACE(id);
    fieldbus::CanFrame frame;
    frame.id = id;
    if (id == 0x000) {
      frame.length = 2;
      frame.data = {0x80, 0x63};  // enter pre-operational, node 99
    } else if (id == 0x77F) {
      frame.length = 1;
      frame.data = {0x05};
    }
    ClosedLoopRig rig({.script = {{{.action = fieldbus::FaultAction::babble,
                                    .bus = "axes_4_6",
                                    .from_ns = failure_ns + 500'000,
                                    .to_ns = failure_ns + 500'001,
                                    .frame = frame,
                                    .period_ns = 1'000'000'000}}}});
    rig.run();
    ASSERT_EQ(rig.fault().fault, Fault::second_master) << fault_name(rig.fault().fault);
    EXPECT_EQ(rig.fault().where, 1);
    EXPECT_EQ(rig.fault().value, id);
    EXPECT_LE(rig.fault().cycle, rig.cycle_at(failure_s) + 2);
    expect_targets_run_out(rig);
    expect_arm_at_rest(rig, 0.01);
    expect_drives_off(rig);
  }
}

// A stop that is asked for isn't a fault, but ends in the same way.
TEST(ClosedLoop, RunsOutWhenAskedToStop) {
  ClosedLoopRig rig({.duration_s = 1.46});
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none);
  const auto stopping = std::find_if(rig.records.begin(), rig.records.end(),
                                     [](const CycleRecord& r) { return r.phase == Phase::stopping; });
  ASSERT_NE(stopping, rig.records.end());
  EXPECT_LT((rig.far_end.truth().X_WT.translation() - rig.truths[stopping->cycle].X_WT.translation()).norm(), 0.01);
  EXPECT_LT(rig.far_end.truth().velocity_W.norm(), at_rest_m_per_s);
  expect_drives_off(rig);
}

// While drives are enabled, a target that isn't where the drive stands would be a jump. A standing drive's reading may
// waver by the count that it is between, and its link sags when the brake lets go.
void expect_no_jump(ClosedLoopRig& rig) {
  const auto& records = rig.records;
  bool rendered = false;
  for (std::size_t k = 1; k < records.size() && !rendered; ++k) {
    rendered = records[k].phase == Phase::rendering;
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const double per_rad = std::abs(rig.cell.drives[axis].counts_per_rad());
      const double off_rad = (records[k].target_counts[axis] - records[k].actual_counts[axis]) / per_rad;
      EXPECT_LT(std::abs(off_rad), 1e-4) << rig.cell.drives[axis].joint << " in cycle " << k;
      if (records[k].phase == Phase::taring && records[k - 1].phase == Phase::taring) {
        EXPECT_EQ(records[k].target_counts[axis], records[k - 1].target_counts[axis]) << "a setpoint that moves";
      }
      if (rendered) {
        EXPECT_LE(std::abs(records[k].target_counts[axis] - records[k - 1].target_counts[axis]), 1)
            << rig.cell.drives[axis].joint << ": the first rendered setpoint";
      }
    }
  }
  EXPECT_TRUE(rendered);
}

TEST(ClosedLoop, StartsWithoutAJump) {
  ClosedLoopRig rig({.duration_s = 0.05});
  rig.run();
  expect_no_jump(rig);
}

// The arm stands where it was left, whatever the cell's file says.
TEST(ClosedLoop, StartsWithoutAJumpFromAnotherPoseThanTheFiles) {
  RigOptions options{.duration_s = 1.0};
  options.start_error_rad = {0.3, -0.2, 0.15, 0.1, -0.2, 0.5};
  ClosedLoopRig rig(options);
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  expect_no_jump(rig);
  EXPECT_LT((vec3(rig.records.back().tool_W_m) - rig.truths.back().X_WT.translation()).norm(), 1e-3);
}

// While one drive took longer to enable (it had a fault to be reset), the others, enabled already, were sent the start
// angles of the cell's file instead of where they stood: axis 2, which its gear's twist keeps off those, moved by 0.4
// mrad at once, and an arm that isn't at its start pose would have gone there.
TEST(ClosedLoop, StartsWithoutAJumpWhenADriveIsLate) {
  for (const char* late : {"axis_1", "axis_3", "axis_6"}) {
    SCOPED_TRACE(late);
    ClosedLoopRig rig({.device_faults = {std::string(late) + ":fault=0x4210"}, .duration_s = 0.05});
    rig.run();
    EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
    expect_no_jump(rig);
  }
}

}  // namespace
}  // namespace proxarm::controller
