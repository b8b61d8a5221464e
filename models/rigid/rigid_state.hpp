// All that a rigid world keeps from one step to the next.
#pragma once

#include <memory>
#include <utility>

#include "models/rigid/linear_problem.hpp"
#include "models/rigid/step_contacts.hpp"
#include "models/rigid_bodies/sides.hpp"
#include "models/rigid_features/mesh_overlap.hpp"
#include "models/rigid_gaps/touches.hpp"
#include "models/rigid_pairs/candidates.hpp"

namespace proxarm::models {

struct RigidState {
  explicit RigidState(std::shared_ptr<const RigidSetup> setup) : bodies(std::move(setup)), candidates(bodies.setup()) {
    // With bends most local problems of the iteration are solved roughly, and a peg that goes by the closed form ends
    // more often in a jam that has no solution: in 17 of 8,000 steps instead of none.
    local.problem.use_closed_form(!bodies.setup().bends);
  }

  void gather(const ToolPose& pose, double reach_m) noexcept;
  // The same, only if the tool at a pose has left half of what was gathered. Whether it had.
  bool gather_if_far(const ToolPose& pose) noexcept;
  void take_sides(const ToolPose& pose, double far_m) noexcept { sides.take(bodies, candidates.all(), pose, far_m); }

  RigidBodies bodies;
  Candidates candidates;
  Sides sides;
  Touches touches;
  LocalProblem local;
  StepContacts contacts;
  LastPlanes last_planes;
  ToolPose q;                    // where the last step ended
  double empty_around_m = -1.0;  // nothing is nearer than this around the pose of the last gathering; −1: not known
  bool unresolved = false, squeezed = false;
};

}  // namespace proxarm::models
