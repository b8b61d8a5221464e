// Where an arm that nobody has placed yet begins: away from singularities and limits, with room for the hand.
#pragma once

#include "models/arm/arm.hpp"
#include "models/description/hand.hpp"

namespace proxarm::command_line {

struct StartPose {
  models::JointVector q;
  double way = 0.0;  // the share of the hand's way that can be gone from there, without a joint's end or a singularity
};

// The same hand with a way of that share of its own.
description::HandDescription with_shorter_way(description::HandDescription hand, double share);

// The best of some thousand poses all over the joints' ranges. Good is: a large smallest singular value, all joints far
// from their ends, the tool in front of the base at a height of a fifth to four fifths of the reach and pointing
// forwards or down, and the joints above the floor. Of these it is the first one from which the hand's whole way can be
// gone; where there is none, half of it or less.
StartPose find_start(const models::Arm& arm, const description::HandDescription& hand);

// The axis of the sensor that points out of the arm, in its link: that of the last joint that turns (of a last one that
// slides, its own), away from the joints before it.
models::Vec3 outwards_in_sensor(const models::Arm& arm);

}  // namespace proxarm::command_line
