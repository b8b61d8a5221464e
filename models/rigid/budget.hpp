// Budgets of a step, of a part of a step, and of the local problems.
//
// A local problem for which no solution is found costs a hundred times as much as an easy local problem. If a step has
// used up its budget, the step is unresolved, and the tool stays at the pose that the parts of the step reached.
#pragma once

#include "models/rigid/local_step.hpp"

namespace proxarm::models {

// Largest number of parts of a step. A step that needs more parts (10 cm with a tool of a millimetre) ends before p̂.
inline constexpr int kMostParts = 512;
// Largest number of poses: of a step; additionally for each part of a step; of one part among several.
inline constexpr int kPosesOfStep = 400, kPosesOfPart = 8, kPosesOfHardPart = 50;
inline constexpr int kLooks = 60000;  // evaluations of pairs in a step
// Number of contacts that the local problems of a step may look at: for a step in one part; for a step in several
// parts; with hollow objects, where a look costs 0.5 µs and most steps take thirty looks; additionally for each part.
inline constexpr int kWorkOfStep = LocalStep::kWork, kWorkOfFar = 2400, kWorkInside = 600, kWorkOfPart = 60;

// Sets the budget of the local problems for a number of parts.
inline void allow_for(int parts, RigidState& state) noexcept {
  const int base = state.bodies.setup().hollow ? kWorkInside : parts > 1 ? kWorkOfFar : kWorkOfStep;
  state.local.problem.allow(base + kWorkOfPart * parts);
}

// Sets the budgets for one part among several. A part without a solution may be followed by a part with a solution. So
// each part gets a separate budget, and the last part, whose forces are reported, gets the largest.
inline void allow_part(bool last, RigidState& state, Attempt& attempt) noexcept {
  attempt.poses_left = last ? kPosesOfStep : kPosesOfHardPart;
  state.local.problem.allow(last ? kWorkOfFar : 2 * kWorkOfPart);
}

}  // namespace proxarm::models
