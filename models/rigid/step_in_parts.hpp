// A step taken in parts on the way from q(k−1) to p̂.
//
// Each part starts where the last one ended, and is so short that no feature gets past the reach of the sides; slip
// counts from q(k−1). A solution in which
// the contacts did work on the tool is on a side to which it didn't come: then the parts are made smaller.
#pragma once

#include "models/rigid/fallback.hpp"
#include "models/rigid/iteration.hpp"
#include "models/rigid/way.hpp"

namespace proxarm::models {

class StepInParts {
 public:
  StepInParts(RigidState& state, Attempt& attempt, Iteration& iteration, Fallback& fallback) noexcept
      : state_(&state), attempt_(&attempt), iteration_(&iteration), fallback_(&fallback) {}

  // From q_old; q is where the parts led. False: some part led nowhere.
  bool take(const Way& way, ToolPose& q) noexcept;
  // The same; false also if they led into an object, which q is taken back from.
  bool take_outside(const Way& way, ToolPose& q) noexcept;
  // The same with each part divided further.
  bool take_smaller(Way way, ToolPose& q) noexcept;
  // Takes a step again whose contacts gave energy.
  bool take_closely(const Way& way, ToolPose& q) noexcept;
  // Into how many smaller parts one is divided. A fast object takes many parts already.
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
