// Where the tool goes if a part of a step has no solution, or leads it into an object.
#pragma once

#include "models/rigid/overlaps.hpp"
#include "models/rigid/rigid_state.hpp"
#include "models/rigid_gaps/touch_search.hpp"

namespace proxarm::models {

class Fallback {
 public:
  Fallback(RigidState& state, Attempt& attempt) noexcept
      : state_(&state),
        attempt_(&attempt),
        search_(state.bodies, state.candidates, state.sides, attempt, state.touches),
        overlaps_(state.bodies, state.candidates, state.last_planes) {}

  // While an object moves, the tool can't just stay. It goes where it has room: where it was, or where that is on an
  // object that moves. False: it is squeezed. Precondition: the sides are those of where it was.
  bool step_aside(ToolPose& q) noexcept;
  // Where a part of the step begins to look for the tool: where it was on the object that held it most, as far as that
  // has moved on. Precondition: the sides are those of where the tool was.
  [[nodiscard]] ToolPose along_with_holder(const ToolPose& q) const noexcept;

  // Whether the tool stands in an object at a pose, by its whole bodies. Costs a look at all of them.
  [[nodiscard]] bool stands_in(const ToolPose& pose) noexcept;
  // The same, if the step may have led it in; then q goes back to where it was, or where that is now.
  bool take_back_if_in(const ToolPose& q_old, ToolPose& q) noexcept;
  [[nodiscard]] bool may_be_in() const noexcept { return state_->bodies.setup().dense || attempt_->lost_contact; }

 private:
  [[nodiscard]] bool has_room(const ToolPose& pose) noexcept;
  [[nodiscard]] ToolPose out_of_the_way(const ToolPose& q_old, const ToolPose& q) noexcept;

  RigidState* state_;
  Attempt* attempt_;
  TouchSearch search_;
  Overlaps overlaps_;
};

}  // namespace proxarm::models
