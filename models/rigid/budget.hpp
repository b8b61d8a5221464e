// What a step, a part of it and its local problems may cost.
//
// A local problem that has no solution, or none that is found, costs a hundred times what an easy one does. A step that
// has used up its budget is unresolved: the tool goes as far as the parts of the step got.
#pragma once

#include "models/rigid/rigid_state.hpp"

namespace proxarm::models {

inline constexpr int kMostParts = 512;  // of a step. A longer one, 10 cm for a tool of a millimetre, ends before p̂
inline constexpr int kBudget = 400, kPosesOfPart = 8, kBudgetOfPart = 50;  // poses
inline constexpr int kLooks = 60000;                                       // pairs

// Contacts that local problems may look at: for each part of a step, in a step of several parts, and where objects are
// hollow, since a look costs 0.5 µs there and most steps take thirty.
inline constexpr int kWorkOfPart = 60, kWorkOfFar = 2400, kWorkInside = 600;

// Allows the local problems of this many parts.
inline void allow_for(int parts, RigidState& state) noexcept {
  const int base = state.bodies.setup().hollow ? kWorkInside : parts > 1 ? kWorkOfFar : LocalStep::kWork;
  state.local.problem.allow(base + kWorkOfPart * parts);
}

// Allows one part among several: a part that has no solution may be followed by one that has, so none may take what the
// last one, whose forces are asked for, needs.
inline void allow_part(bool last, RigidState& state, Attempt& attempt) noexcept {
  attempt.poses_left = last ? kBudget : kBudgetOfPart;
  state.local.problem.allow(last ? kWorkOfFar : 2 * kWorkOfPart);
}

}  // namespace proxarm::models
