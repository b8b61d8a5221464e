// Chooses the poses for identifying the tool. The wrist turns the tool so that the weight's directions in S differ as
// much as ranges and limits allow.
//
// Only the outermost three revolute joints move, each by at most most_turn_rad from its first angle. The candidates are
// a grid of such poses. They are chosen one by one, each time the pose that maximises the determinant of the scatter of
// R_SW g (D-optimal design). The arm visits the chosen poses on the shortest closed round; since the round ends where
// it began, the sensor's drift shows. On the way, the rendered point stays within the cell's limits.
#pragma once

#include <vector>

#include "controller/extras/proof/proof.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::identification {

inline constexpr double most_turn_rad = 0.9;

// Returns the stations. The first and the last station are at the motors' angles `motor_rad`. If no joint turns the
// weight, or if no joint turns at all, the first station is the only one. Throws SetupError if the limits leave too few
// poses.
std::vector<proof::Station> tool_stations(const description::Cell& cell, const models::Arm& arm,
                                          const models::JointVector& motor_rad);

}  // namespace proxarm::identification
