// Where a point is touched, and by which share of the world's force. Not for the cycle, which knows only their sum.
#pragma once

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

// Sets place and force of each contact of a point. All are at the proxy, and their forces add up to f(k). One contact
// bears all of it. For several the forces along the normals are those, none of them pulling, that explain most of f
// (least squares); the rest is friction, which each bears in proportion to its normal force times μ. That is unique
// without friction and with independent normals; with friction the laws of contact leave it open.
void place_contacts(CycleRecord& record) noexcept;

}  // namespace proxarm::controller
