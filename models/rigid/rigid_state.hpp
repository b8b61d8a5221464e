// Stores what a rigid world keeps from one step to the next.
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
    // The closed form isn't used with bends: a peg in a hole would then end more often in a jam without a solution, in
    // 17 of 8,000 steps instead of none. (With bends most local problems are solved roughly.)
    local.problem.use_closed_form(!bodies.setup().bends);
  }

  void gather(const ToolPose& pose, double reach_m) noexcept;
  // Gathers pairs anew if the tool has moved by more than half of the pairs' reach. Returns whether it gathered.
  bool gather_if_far(const ToolPose& pose) noexcept;
  void take_sides(const ToolPose& pose, double far_m) noexcept { sides.take(bodies, candidates.all(), pose, far_m); }

  RigidBodies bodies;
  Candidates candidates;
  Sides sides;
  Touches touches;
  LocalProblem local;
  StepContacts contacts;
  LastPlanes last_planes;
  ToolPose q;  // pose at which the last step ended
  // No object is nearer than this to the tool at the pose of the last gathering, m; −1: not known
  double empty_around_m = -1.0;
  bool unresolved = false, squeezed = false;
};

}  // namespace proxarm::models
