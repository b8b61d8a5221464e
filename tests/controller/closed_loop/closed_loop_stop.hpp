// What a controlled stop is, for tests that make something fail in the middle of a motion.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/controller/closed_loop/closed_loop_rig.hpp"

namespace proxarm::controller::testing {

// Since power on: cycles begin at 0.2 s, the hand at 0.44 s; at 1.9 s it moves the tool at about 0.1 m/s through free
// space.
inline constexpr double failure_s = 1.9;
inline constexpr std::int64_t failure_ns = 1'900'000'000;

// Brakes are on by then, but the hand still pulls: it goes on at 0.1 m/s, so its 500 N/m pull 50 N/s harder, on an arm
// that gives way by 1 mm in 50 N or more. That is 1 mm/s.
inline constexpr double at_rest_m_per_s = 1e-3;

// Setpoints of the stop: each joint goes on in its direction, slower every cycle, with no more than its deceleration,
// and stands still in the end. Rounding to counts is worth half a count per setpoint, two in a second difference.
inline void expect_targets_run_out(const ClosedLoopRig& rig, const std::vector<int>& but_of_axes = {}) {
  const auto& records = rig.records;
  const auto first = static_cast<std::size_t>(rig.fault().cycle);
  ASSERT_GT(first, 2u);
  // Then the drives are switched off, and their targets follow where they stand.
  std::size_t last = first;
  while (last + 1 < records.size() && records[last].phase <= Phase::stopping) ++last;
  ASSERT_GT(last, first);
  const double T = rig.options.settings.period_s;
  double fastest = 0.0;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    if (std::count(but_of_axes.begin(), but_of_axes.end(), static_cast<int>(axis)) > 0) continue;
    const description::DriveDescription& drive = rig.cell.drives[axis];
    const double most_counts = drive.max_acceleration_rad_per_s2 * std::abs(drive.counts_per_rad()) * T * T + 2.0;
    for (std::size_t k = first; k <= last; ++k) {
      const double step = records[k].target_counts[axis] - records[k - 1].target_counts[axis];
      const double step_k1 = records[k - 1].target_counts[axis] - records[k - 2].target_counts[axis];
      if (k == first) fastest = std::max(fastest, std::abs(step_k1) / std::abs(drive.counts_per_rad()) / T);
      EXPECT_LE(std::abs(step - step_k1), most_counts) << drive.joint << " in cycle " << k;
      EXPECT_LE(std::abs(step), std::abs(step_k1) + 1.0) << drive.joint << " in cycle " << k;
      EXPECT_GE(step * step_k1, -2.0) << drive.joint << " turns back in cycle " << k;
    }
    EXPECT_LE(std::abs(records[last].target_counts[axis] - records[last - 1].target_counts[axis]), 1) << drive.joint;
  }
  EXPECT_GT(fastest, 0.05) << "rad/s: the arm was to be moving when it failed";
}

// The tool itself: by how much it goes on, and that it stands. `free_axis` may do what its drive does by itself.
inline void expect_arm_at_rest(ClosedLoopRig& rig, double most_m) {
  const auto first = static_cast<std::size_t>(rig.fault().cycle);
  const models::Vec3 at_fault = rig.truths[first].X_WT.translation();
  const sim::Truth last = rig.far_end.truth();
  EXPECT_LT((last.X_WT.translation() - at_fault).norm(), most_m);
  EXPECT_LT(last.velocity_W.norm(), at_rest_m_per_s);
}

inline void expect_drives_off(ClosedLoopRig& rig, int but_of_axis = -1) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    if (static_cast<int>(axis) == but_of_axis) continue;
    EXPECT_FALSE(rig.far_end.drive(axis).state() == sim::DriveState::operation_enabled) << rig.cell.drives[axis].joint;
  }
}

// Everything at once. `most_cycles`: from the failure to the first setpoint of the stop.
inline void expect_controlled_stop(ClosedLoopRig& rig, Fault fault, std::int32_t where, std::size_t most_cycles) {
  ASSERT_EQ(fault_name(rig.fault().fault), std::string(fault_name(fault)));
  EXPECT_EQ(rig.fault().where, where);
  const std::size_t failed = rig.cycle_at(failure_s);
  EXPECT_GE(rig.fault().cycle + 1, failed);
  EXPECT_LE(rig.fault().cycle, failed + most_cycles);
  ::testing::Test::RecordProperty("cycles_until_reaction",
                                  static_cast<int>(rig.fault().cycle) - static_cast<int>(failed));
  EXPECT_EQ(rig.cycle->supervisor().phase(), Phase::done);
  // The setpoint of a drive that is off by itself follows it.
  const bool is_off = fault == Fault::drive_fault || fault == Fault::drive_silent;
  expect_targets_run_out(rig, {is_off ? where : -1});
  expect_arm_at_rest(rig, 0.01);
  const bool without_power =
      !rig.options.device_faults.empty() && rig.options.device_faults[0].find("power") != std::string::npos;
  expect_drives_off(rig, without_power ? where : -1);
}

}  // namespace proxarm::controller::testing
