// Keeps the remaining budgets, the rules and the events of one attempt at a step.
#pragma once

#include "models/rigid_shapes/touch.hpp"

namespace proxarm::models {

// How far beside a feature a foot may lie so that the touch still counts, m.
struct FootReach {
  double beside = beside_m;  // beside any feature
  double over = beside_m;    // beyond a valley or an edge's end, for a pair that pressed in the last solution
};

struct Attempt {
  // Budgets. Without budgets a local problem without a solution took up to 13 ms of a cycle, and a step among hundreds
  // of pairs up to 50 ms.
  int poses_left = 0;    // number of iterates
  int looks_left = 0;    // number of evaluations of a pair, some 15 ns each
  int retries_left = 0;  // number of local problems that may be tried again with fewer contacts or without bends

  // Rules.
  bool without_friction = false;
  bool refines = false;  // a part of the step in which the contacts give energy is taken again in smaller parts
  bool bends = false;    // the gaps' curvature counts
  FootReach feet;

  // Events.
  bool overflow = false;  // there was no room for a contact
  // In some part of the step, an iterate left all contacts that pressed in the iterate before
  bool lost_contact = false;
  bool squeezed = false;  // moving objects leave the tool no room
};

}  // namespace proxarm::models
