// Where the arm stands to have its tool identified: poses of the wrist that turn the weight in S as many ways as its
// ranges and borders let it.
//
// Only the outermost three joints that turn are moved, each by most_turn_rad at most from where the arm was found. Of a
// grid of such poses those are taken, one after the other, that make the determinant of the scatter of R_SW g largest
// (D-optimal design). They are visited on the shortest round, which ends where it began: what the zero has drifted
// meanwhile shows there. The path of the rendered point between two poses keeps out of what the cell's limits forbid.
#pragma once

#include <vector>

#include "controller/proof/proof.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::identification {

inline constexpr double most_turn_rad = 0.9;

// The stations from the motors' angles `motor_rad` on, the first and the last of them there. Throws SetupError if
// borders leave too few. If no joint turns the weight, or none turns at all, the only station is the first.
std::vector<proof::Station> tool_stations(const description::Cell& cell, const models::Arm& arm,
                                          const models::JointVector& motor_rad);

}  // namespace proxarm::identification
