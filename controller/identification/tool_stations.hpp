// Chooses the poses for identifying the tool: the wrist turns the weight in S as differently as ranges and limits
// allow.
//
// Only the outermost three revolute joints move, each by at most most_turn_rad from its first angle. From a grid of
// such poses, those are chosen one by one that maximise the determinant of the scatter of R_SW g (D-optimal design).
// The arm visits them on the shortest closed round, so the sensor's drift shows at its end. On the way the rendered
// point stays within the cell's limits.
#pragma once

#include <vector>

#include "controller/proof/proof.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::identification {

inline constexpr double most_turn_rad = 0.9;

// Returns the stations; the first and the last are at the motors' angles `motor_rad`. Throws SetupError if limits leave
// too few. If no joint turns the weight, or no joint turns at all, the first station is the only one.
std::vector<proof::Station> tool_stations(const description::Cell& cell, const models::Arm& arm,
                                          const models::JointVector& motor_rad);

}  // namespace proxarm::identification
