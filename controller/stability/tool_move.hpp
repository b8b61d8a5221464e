// Displacement and rotation of a tool in one period, about its rendered point, in W: by the model of its links, and by
// the motors (link_motion.hpp). Both at the time of the present force.
#pragma once

#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

struct ToolMove {
  models::Twist links_W = models::Twist::Zero(), motors_W = models::Twist::Zero();
};

}  // namespace proxarm::controller
