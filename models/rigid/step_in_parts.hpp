// A step, or all of it that remains, taken in parts on the way from q(k−1) to p̂.
//
// Each part is a step of 𝒢 from q(k−1), so short that no feature gets past the reach of the sides. A solution in which
// the contacts did work on the tool is on a side to which it didn't come: then the parts are made smaller.
#pragma once

#include "models/rigid/fallback.hpp"
#include "models/rigid/step_in_batches.hpp"

namespace proxarm::models {

// A step from q_old to p̂, divided into parts; no point of the tool, nor of what it may meet, goes further than far_m.
struct Way {
  const ToolPose &p_hat, &q_old;
  double far_m = 0.0;
  int parts = 1;
};

class StepInParts {
 public:
  StepInParts(RigidState& state, Attempt& attempt, Iteration& iteration, Fallback& fallback) noexcept
      : state_(&state), attempt_(&attempt), iteration_(&iteration), fallback_(&fallback) {}

  // From q_old; q is where the parts led. False: some part led nowhere.
  bool take(const Way& way, ToolPose& q) noexcept;
  // The same with each part divided further.
  bool take_smaller(Way way, ToolPose& q) noexcept;
  // Takes a step again whose contacts gave energy. False also if it led into an object.
  bool take_closely(const Way& way, ToolPose& q) noexcept;
  // Into how many smaller parts one is divided. A fast object takes many parts already.
  [[nodiscard]] int finer(int parts) const noexcept;
  [[nodiscard]] bool gives_energy(const ToolPose& q, const ToolPose& q_old) noexcept;

 private:
  struct Range {
    int first = 1, last = 1;
  };
  bool take_parts(const Way& way, double each, const Range& range, ToolPose& q) noexcept;
  bool take_part_closely(const Way& way, double each, int part, ToolPose& q) noexcept;

  RigidState* state_;
  Attempt* attempt_;
  Iteration* iteration_;
  Fallback* fallback_;
};

}  // namespace proxarm::models
