// What one attempt at a step may still cost, by which rules it goes, and what happened in it.
#pragma once

#include "models/rigid_shapes/touch.hpp"

namespace proxarm::models {

// How far beside a feature a foot may lie and still count, m.
struct FootReach {
  double beside = beside_m;  // beside any feature
  double over = beside_m;    // beyond a valley or an edge's end, for a pair that pressed in the last solution
};

struct Attempt {
  // Budgets: without them a local problem that has no solution took up to 13 ms of a cycle, and a step among hundreds
  // of pairs up to 50 ms.
  int poses_left = 0;    // iterates
  int looks_left = 0;    // evaluations of a pair, some 15 ns each
  int retries_left = 0;  // local problems that are tried again with fewer contacts

  // Rules.
  bool without_friction = false;
  bool refines = false;  // a part in which the contacts give energy is taken again in smaller parts
  bool bends = false;    // the gaps' curvature counts
  FootReach feet;

  // Events.
  bool overflow = false;      // there was no room for a contact
  bool lost_contact = false;  // an iterate left all that pressed before it, in some part of the step
  bool squeezed = false;      // moving objects leave the tool no room
};

}  // namespace proxarm::models
