// Finds start poses for an arm: away from singularities and limits, with room for the hand's motion.
#pragma once

#include <vector>

#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"
#include "models/description/hand.hpp"

namespace proxarm::command_line {

struct StartPose {
  models::JointVector q;
  double way = 0.0;  // share of the hand's path that the arm can follow from there without reaching a joint's end or a
                     // singularity
};

// Returns the hand with its path scaled by that share.
description::HandDescription with_shorter_way(description::HandDescription hand, double share);
// For a tool that moves in a plane or on a line: turns the path so that ahead is the space's first axis, and sideways
// the second.
description::HandDescription with_way_in(const models::ToolSpace& space, description::HandDescription hand);

// Searches twenty thousand poses all over the joints' ranges. In a good pose the tool can move well in all directions
// (place_margin.hpp), the wrist is far from its singularity, and all joints are far from their ends and above the
// floor. The tool is in front of the base at a fifth to four fifths of the reach and points forwards or down. Returns
// at most `most` poses, the best first, from which the arm can follow the hand's whole path, else half of it or less;
// they differ by more than 0.3 rad (or 0.3 m) in some joint. An upright first joint is turned straight ahead if
// possible. If a tenth of the path is too much everywhere, returns the best pose with way = 0.
std::vector<StartPose> find_starts(const models::Arm& arm, const description::HandDescription& hand, std::size_t most);

// Returns the direction out of the arm, in the sensor's link: the axis of the last joint, away from the joints before
// it.
models::Vec3 outwards_in_sensor(const models::Arm& arm);

}  // namespace proxarm::command_line
