// By what way and angle a tool has moved in a period, about its rendered point, in W: as its links are taken to move,
// and as the motors do (link_motion.hpp). Both at the time of the force that is there now.
#pragma once

#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

struct ToolMove {
  models::Twist links_W = models::Twist::Zero(), motors_W = models::Twist::Zero();
};

}  // namespace proxarm::controller
