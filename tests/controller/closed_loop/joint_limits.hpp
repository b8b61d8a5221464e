// What must hold of all that the drives were sent in a session, whatever happened in it.
#pragma once

#include <gtest/gtest.h>

#include "tests/controller/closed_loop/closed_loop_rig.hpp"

namespace proxarm::controller::testing {

// Whether setpoints lead the arm in this phase.
inline bool live(Phase phase) { return phase >= Phase::rendering && phase <= Phase::stopping; }

// Nothing that the drives were sent goes beyond their joints' speed and acceleration by more than rounding to counts,
// whatever the phases were.
inline void expect_within_joint_limits(const ClosedLoopRig& rig) {
  for (std::size_t axis = 0; axis < rig.cell.drives.size(); ++axis) {
    for (std::size_t k = 2; k < rig.records.size(); ++k) {
      if (!live(rig.records[k].phase) || !live(rig.records[k - 1].phase) || !live(rig.records[k - 2].phase)) continue;
      // The setpoint of a drive that is off by itself follows it.
      const auto follows = [&](std::size_t i) {
        return rig.records[i].target_counts[axis] == rig.records[i].actual_counts[axis];
      };
      if (follows(k) || follows(k - 1) || follows(k - 2)) continue;
      expect_step_within_limits(rig, axis, k);
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

}  // namespace proxarm::controller::testing
