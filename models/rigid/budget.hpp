// What a step, a part of it and its local problems may cost.
//
// A local problem that has no solution, or none that is found, costs a hundred times what an easy one does. A step that
// has used up its budget is unresolved: the tool goes as far as the parts of the step got.
#pragma once

#include "models/rigid/local_step.hpp"

namespace proxarm::models {

// Parts of a step. A longer one, 10 cm for a tool of a millimetre, ends before p̂.
inline constexpr int kMostParts = 512;
// Poses of a step, for each of its parts more, and of a part among several.
inline constexpr int kPosesOfStep = 400, kPosesOfPart = 8, kPosesOfHardPart = 50;
inline constexpr int kLooks = 60000;  // evaluations of a pair
// Contacts that the local problems of a step may look at: of a step in one part; of one in several parts; with hollow
// objects, where a look costs 0.5 µs and most steps take thirty; for each part more.
inline constexpr int kWorkOfStep = LocalStep::kWork, kWorkOfFar = 2400, kWorkInside = 600, kWorkOfPart = 60;

// Allows the local problems of this many parts.
inline void allow_for(int parts, RigidState& state) noexcept {
  const int base = state.bodies.setup().hollow ? kWorkInside : parts > 1 ? kWorkOfFar : kWorkOfStep;
  state.local.problem.allow(base + kWorkOfPart * parts);
}

// Allows one part among several: a part that has no solution may be followed by one that has, so none may take what the
// last one, whose forces are asked for, needs.
inline void allow_part(bool last, RigidState& state, Attempt& attempt) noexcept {
  attempt.poses_left = last ? kPosesOfStep : kPosesOfHardPart;
  state.local.problem.allow(last ? kWorkOfFar : 2 * kWorkOfPart);
}

}  // namespace proxarm::models
