// Chooses the tool's pose if a part of a step has no solution or leads the tool into an object.
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

  // Moves the tool to a pose with room: q itself, or the former pose carried along with one of the moving objects.
  // (While an object moves, the tool can't always stay at q.) Returns false if there is no such pose; the tool is then
  // squeezed. Precondition: the sides were taken at the former pose.
  bool step_aside(ToolPose& q) noexcept;
  // Returns the pose from which a part of the step starts its iteration: the former pose, carried along with the moving
  // object that held the tool most. Precondition: the sides were taken at the former pose.
  [[nodiscard]] ToolPose along_with_holder(const ToolPose& q) const noexcept;

  // Whether the tool stands in an object at a pose. Compares whole bodies, which takes a look at each object.
  [[nodiscard]] bool stands_in(const ToolPose& pose) noexcept;
  // If the step may have led the tool into an object, and stands_in(q) is true, sets q back to q_old, or to q_old
  // carried along with a moving object. Returns whether it did so.
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
