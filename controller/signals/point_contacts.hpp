// Estimates place and force of each contact of a point tool. Not for the cycle, which knows only the sum of the forces.
#pragma once

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

// Sets place and force of each contact of a point tool. All contacts are at the proxy, and their forces add up to f(k).
// A single contact carries all of f(k). For several contacts, the normal forces are the least-squares fit to f(k)
// without pulling. The rest of f(k) is friction, shared in proportion to μ times the normal force. The result is unique
// without friction and with independent normals; with friction, the laws of contact leave it open.
void place_contacts(CycleRecord& record) noexcept;

}  // namespace proxarm::controller
