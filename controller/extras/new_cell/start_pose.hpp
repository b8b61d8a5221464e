// Finds start poses for an arm: far from singularities and from the ends of the joints' ranges, with room for the
// hand's motion.
#pragma once

#include <vector>

#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"
#include "models/description/hand.hpp"

namespace proxarm::command_line {

struct StartPose {
  models::JointVector q;
  // Share of the hand's path that the arm can follow from this pose without reaching an end of a joint's range or a
  // singularity.
  double way = 0.0;
};

// Returns the hand with its path scaled by `share`.
description::HandDescription with_shorter_way(description::HandDescription hand, double share);
// Returns the hand with its path turned for a tool that moves only in a plane or on a line: the path's direction ahead
// becomes the first axis of the tool's space, and its direction sideways the second axis.
description::HandDescription with_way_in(const models::ToolSpace& space, description::HandDescription hand);

// Judges twenty thousand poses all over the joints' ranges, and returns at most `most` of them, the best first. In a
// good pose the tool can move well in all directions (place_margin.hpp), the wrist is far from its singularity, and all
// joints are far from the ends of their ranges and above the floor. The tool is in front of the base, at a height of a
// fifth to four fifths of the reach, and points forwards or down.
//
// From the returned poses the arm can follow the hand's whole path. If there is no such pose, the arm can follow half,
// a quarter or a tenth of the path. Any two of the poses differ by more than 0.3 rad (or 0.3 m) in some joint. An
// upright first joint is turned so that the tool is straight ahead, if possible. If the arm can't follow a tenth of the
// path from any pose, returns the best pose with way = 0.
std::vector<StartPose> find_starts(const models::Arm& arm, const description::HandDescription& hand, std::size_t most);

// Returns the direction that points out of the arm, in the frame of the sensor's link. It is along the last joint's
// axis, away from the earlier joints.
models::Vec3 outwards_in_sensor(const models::Arm& arm);

}  // namespace proxarm::command_line
