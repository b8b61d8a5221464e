// Where an arm that nobody has placed yet begins: away from singularities and limits, with room for the hand.
#pragma once

#include <vector>

#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"
#include "models/description/hand.hpp"

namespace proxarm::command_line {

struct StartPose {
  models::JointVector q;
  double way = 0.0;  // the share of the hand's way that can be gone from there, without a joint's end or a singularity
};

// The same hand with a way of that share of its own.
description::HandDescription with_shorter_way(description::HandDescription hand, double share);
// Of a tool that moves in a plane or on a line: ahead is along its first axis, and to the side along the second.
description::HandDescription with_way_in(const models::ToolSpace& space, description::HandDescription hand);

// The best of some thousand poses all over the joints' ranges. Good is: a place that can be moved well in all
// directions (place_margin.hpp) with a wrist that is far from its singularity, all joints far from their ends, the tool
// in front of the base at a height of a fifth to four fifths of the reach and pointing forwards or down, and the joints
// above the floor. Of these it is the first one from which the hand's whole way can be gone, straight ahead of an
// upright first joint, else wherever that joint has it; where there is none, half of it or less. Further ones follow,
// up to `most`, each of which has a joint that is turned by 0.3 rad (or moved by 0.3 m) from all before.
std::vector<StartPose> find_starts(const models::Arm& arm, const description::HandDescription& hand, std::size_t most);

// The axis of the sensor that points out of the arm, in its link: that of the last joint that turns (of a last one that
// slides, its own), away from the joints before it.
models::Vec3 outwards_in_sensor(const models::Arm& arm);

}  // namespace proxarm::command_line
