#include "models/rigid/rigid_state.hpp"

#include "models/rigid_pairs/gathering.hpp"

namespace proxarm::models {

void RigidState::gather(const ToolPose& pose, double reach_m) noexcept {
  Gathering(bodies, candidates).gather(pose, reach_m);
}

bool RigidState::gather_if_far(const ToolPose& pose) noexcept {
  if (!(candidates.came_m(bodies, pose) > 0.5 * candidates.gathered_reach_m)) return false;
  gather(pose, candidates.gathered_reach_m);
  return true;
}

}  // namespace proxarm::models
