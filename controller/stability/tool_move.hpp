// A tool's displacement and rotation in one period, about its rendered point, in W. There are two estimates
// (link_motion.hpp): one by the model of the links, one by the motors. Both belong to the time at which the present
// force was measured.
#pragma once

#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

struct ToolMove {
  models::Twist links_W = models::Twist::Zero(), motors_W = models::Twist::Zero();
};

}  // namespace proxarm::controller
