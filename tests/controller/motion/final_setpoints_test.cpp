#include "controller/motion/final_setpoints.hpp"

#include <gtest/gtest.h>

#include <string>

#include "models/description/cell.hpp"
#include "tests/controller/motion/fake_devices.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;

// A setpoint that is wanted far away, in one joint, from drives that say nothing in this cycle.
FinalSetpoints::Result with_wanted(const std::string& cell_file, int joint, double away) {
  const description::Cell cell = description::load_cell(source_file(cell_file));
  const models::Arm arm(cell);
  FinalSetpoints setpoints(arm, cell.drives, cell.limits, 1e-3);
  Measured measured;
  measured.motor_rad = measured.link_rad = measured.drive_target_rad = arm.start_rad();
  measured.moved_rad = measured.jump_rad = JointVector::Zero(arm.axes());
  measured.answers = {JointVector::Zero(arm.axes()), JointVector::Zero(arm.axes())};
  measured.tool_W = arm.tool_pose(arm.start_rad()).translation();
  JointVector wanted = arm.start_rad();
  wanted[joint] += away;
  return setpoints.step(wanted, measured, {cell.limits.max_tool_speed_m_per_s, measured.tool_W, nullptr});
}

// An arm whose joints all slide had a lever of 0/0 for each, and no lag of it was ever seen: its proxy went on from
// setpoints that the drives were never sent. A rail's lag counted as none beside an arm's.
TEST(FinalSetpoints, ALagOfAPrismaticJointIsSeenAsThatOfARevoluteOne) {
  for (const char* const file : {"models/cells/linear.yaml", "models/cells/gantry.yaml", "models/cells/rail.yaml",
                                 "models/cells/default.yaml"}) {
    EXPECT_TRUE(with_wanted(file, 0, 0.5).differs) << file;
    EXPECT_FALSE(with_wanted(file, 0, 1e-4).differs) << file;
  }
}

}  // namespace
}  // namespace proxarm::controller
