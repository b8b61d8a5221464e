// Takes a step in parts on the way from q(k−1) to p̂.
//
// 1. Each part starts at the pose at which the part before ended. A part is so short that no feature gets beyond the
//    reach of the sides. Slip counts from q(k−1).
// 2. If the contacts of a solution did work on the tool, the tool has come to a wrong side. The parts are then made
//    smaller.
#pragma once

#include "models/rigid/fallback.hpp"
#include "models/rigid/iteration.hpp"
#include "models/rigid/way.hpp"

namespace proxarm::models {

class StepInParts {
 public:
  StepInParts(RigidState& state, Attempt& attempt, Iteration& iteration, Fallback& fallback) noexcept
      : state_(&state), attempt_(&attempt), iteration_(&iteration), fallback_(&fallback) {}

  // Takes the step from q_old, and writes the reached pose to q. Returns false if some part had no solution.
  bool take(const Way& way, ToolPose& q) noexcept;
  // Does the same. Returns false, too, if the parts led into an object; q is then taken back out of the object.
  bool take_outside(const Way& way, ToolPose& q) noexcept;
  // Does the same as take_outside(), with each part divided further.
  bool take_smaller(Way way, ToolPose& q) noexcept;
  // Takes a step again in smaller parts, because its contacts gave energy.
  bool take_closely(const Way& way, ToolPose& q) noexcept;
  // Returns into how many smaller parts a part is divided. The number is smaller with moving objects, because a step
  // among fast objects has many parts already.
  [[nodiscard]] int parts_of_part(int parts) const noexcept;
  [[nodiscard]] bool gives_energy(const ToolPose& q, const ToolPose& q_old) noexcept;

 private:
  struct Range {
    int first = 1, last = 1;
  };
  bool take_parts(const Way& way, double each_m, const Range& range, ToolPose& q) noexcept;
  bool take_part_closely(const Way& way, double each_m, int part, ToolPose& q) noexcept;

  RigidState* state_;
  Attempt* attempt_;
  Iteration* iteration_;
  Fallback* fallback_;
};

}  // namespace proxarm::models
