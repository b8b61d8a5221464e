// Limits in the closed loop: what drives are sent, borders, and a joint that jams.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/controller/closed_loop/closed_loop_rig.hpp"

namespace proxarm::controller {
namespace {

using testing::ClosedLoopRig;
using testing::expect_step_within_limits;
using testing::RigOptions;

// Of all that the drives were sent while they were led: nothing beyond the joints' limits but rounding to counts.
void expect_within_joint_limits(const ClosedLoopRig& rig) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    for (std::size_t k = 2; k < rig.records.size(); ++k) {
      if (rig.records[k].phase != Phase::rendering && rig.records[k].phase != Phase::stopping) continue;
      if (rig.records[k - 2].phase < Phase::taring) continue;
      expect_step_within_limits(rig, axis, k);
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

std::size_t cycles_with(const ClosedLoopRig& rig, RecordFlag flag) {
  return static_cast<std::size_t>(
      std::count_if(rig.records.begin(), rig.records.end(), [&](const CycleRecord& r) { return r.has(flag); }));
}

TEST(ClosedLoopLimits, AreQuietInTheDefaultSession) {
  ClosedLoopRig rig({.duration_s = 9.5});
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  expect_within_joint_limits(rig);
  for (const LimitFlag& flag : limit_flags) {
    if (flag.limit == Limit::joint_acceleration) continue;  // a cycle or two when the hand lets go
    EXPECT_EQ(cycles_with(rig, flag.flag), 0u) << limit_parameter(flag.limit);
  }
}

// The hand moves 0.18 m along x; the box ends after 0.05 m of it.
TEST(ClosedLoopLimits, KeepTheToolInItsWorkspaceAndOutOfZones) {
  for (const bool zone : {false, true}) {
    SCOPED_TRACE(zone ? "zone" : "workspace");
    ClosedLoopRig rig({.duration_s = 4.0, .scene = "scenes/free.yaml"});
    if (zone) {
      rig.cell.limits.keep_out.push_back({{0.75, -1.0, 0.0}, {0.8, 1.0, 1.0}});
    } else {
      rig.cell.limits.workspace_min_m = {0.5, -0.2, 0.4};
      rig.cell.limits.workspace_max_m = {0.75, 0.2, 0.8};
    }
    rig.run();
    EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
    expect_within_joint_limits(rig);
    EXPECT_GT(cycles_with(rig, zone ? RecordFlag::limit_keep_out : RecordFlag::limit_workspace), 100u);
    double furthest = 0.0;
    for (const CycleRecord& r : rig.records) {
      if (r.phase == Phase::rendering) furthest = std::max(furthest, r.proxy_W_m[0]);
    }
    EXPECT_LE(furthest, 0.75 + 1e-9);
    EXPECT_GT(furthest, 0.74);
  }
}

// A joint that jams in the middle of a motion, is pushed on for 0.4 s, and comes free; or for 1.2 s, for which the arm
// is held, and goes on when it is told to.
TEST(ClosedLoopLimits, WindNothingUpBehindABlockedJoint) {
  for (const char* joint : {"axis_1", "axis_2", "axis_3", "axis_5", "axis_2 for long"}) {
    SCOPED_TRACE(joint);
    const std::string jams = std::string(joint).substr(0, 6) + ":jammed@1.5s..";
    const bool is_long = std::string(joint).size() > 6;
    RigOptions options{.device_faults = {jams + (is_long ? "2.7s" : "1.9s")}, .duration_s = 4.0};
    if (is_long) options.commands = {{3'000'000'000, {Order::resume}}};
    ClosedLoopRig rig(options);
    rig.run();
    EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
    EXPECT_EQ(rig.cycle->supervisor().notice(Fault::drive_blocked).times, is_long ? 1u : 0u);
    expect_within_joint_limits(rig);
    double fastest = 0.0, longest = 0.0;
    for (std::size_t k = 0; k < rig.records.size(); ++k) {
      if (rig.records[k].phase != Phase::rendering) continue;
      fastest = std::max(fastest, rig.truths[k].velocity_W.norm());
      longest = std::max(longest, (vec3(rig.records[k].proxy_W_m) - vec3(rig.records[k].tool_W_m)).norm());
    }
    EXPECT_LT(fastest, rig.cell.limits.max_tool_speed_m_per_s);
    EXPECT_LE(longest, rig.cell.limits.leash_m + 1e-6);
    RecordProperty(std::string("tip_speed_max_m_per_s_") + joint, std::to_string(fastest));
    std::printf("%s: tip %.3f m/s, proxy to tool %.2f mm, waited %zu cycles\n", joint, fastest, 1e3 * longest,
                cycles_with(rig, RecordFlag::limit_following_error));
  }
}

// Random session 2207 ended by leash_exceeded: axis_2 jammed at 0.77 rad/s, and its setpoint, which had forgotten each
// cycle how far it still had to brake, swung by 16 mrad to either side of it for as long as it was stuck.
TEST(ClosedLoopLimits, LetTheSetpointOfAJointThatJamsAtSpeedComeToRest) {
  ClosedLoopRig rig({.device_faults = {"axis_2:jammed@1.2s..1.6s"},
                     .duration_s = 2.5,
                     .scene = "scenes/free.yaml",
                     .edit_cell = [](description::Cell& cell) { cell.drives[1].max_acceleration_rad_per_s2 = 20.0; },
                     .edit_hand =
                         [](description::HandDescription& hand) {
                           hand.waypoints = {{0.7, {0.0, 0.0, 0.0}}, {1.4, {-0.35, 0.0, 0.0}}};
                         }});
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  expect_within_joint_limits(rig);
  const description::DriveDescription& drive = rig.cell.drives[1];
  const auto speed = [&](std::size_t k) {
    return (rig.records[k].target_counts[1] - rig.records[k - 1].target_counts[1]) / drive.counts_per_rad() /
           rig.options.settings.period_s;
  };
  const double at = std::abs(speed(rig.cycle_at(1.199)));
  EXPECT_GT(at, 0.4) << "or the test says little";
  // Braking takes u/a, and so does the way back, at the most; two cycles each to notice.
  const double settled_s = 1.2 + 2.5 * at / drive.max_acceleration_rad_per_s2 + 0.004;
  double furthest_rad = 0.0;
  for (std::size_t k = rig.cycle_at(settled_s); k < rig.cycle_at(1.6); ++k) {
    const double ahead = rig.records[k].target_counts[1] - rig.records[k].actual_counts[1];
    furthest_rad = std::max(furthest_rad, std::abs(ahead / drive.counts_per_rad()));
  }
  // What the arm's gears let the motor turn when it stops, on top of the rounding to counts.
  EXPECT_LE(furthest_rad, rig.cell.limits.following_error_rad + 1e-4);
}

// The hand pulls the tool out to where the arm is stretched: it slows, it doesn't fault, and it comes back.
TEST(ClosedLoopLimits, SlowTheToolAtTheEndOfItsReach) {
  ClosedLoopRig rig({.duration_s = 5.0, .scene = "scenes/free.yaml"});
  for (std::size_t axis : {1u, 2u}) {
    rig.cell.drives[axis].range_rad = {rig.cell.start_rad[axis] - 0.06, rig.cell.start_rad[axis] + 0.06};
  }
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  expect_within_joint_limits(rig);
  EXPECT_GT(cycles_with(rig, RecordFlag::limit_joint), 50u);
  for (const CycleRecord& r : rig.records) {
    for (std::size_t axis : {1u, 2u}) {
      const description::DriveDescription& drive = rig.cell.drives[axis];
      const double angle = (r.target_counts[axis] - drive.offset_counts) / drive.counts_per_rad();
      if (r.phase != Phase::rendering) continue;
      ASSERT_LE(angle, drive.range_rad[1] + 1.0 / std::abs(drive.counts_per_rad()));
      ASSERT_GE(angle, drive.range_rad[0] - 1.0 / std::abs(drive.counts_per_rad()));
    }
  }
}

}  // namespace
}  // namespace proxarm::controller
