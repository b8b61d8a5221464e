// From the readings of a session in which the arm stood in several poses to what hangs behind its sensor.
//
// Where the links stood is computed from the motors' angles and the twist of the gears, and that from the tool which is
// to be found: the fit begins with the cell's tool and is repeated with the one that it found. What is allowed for:
//   mounting   0.5 degrees, of the sensor on its flange and of the base, about each axis
//   drift      the cell's sensor.zero_drift_N from the first pose to the last
//   gears      a fifth of the change of their twist from pose to pose (stiffness is known to that), and in joints that
//              move 2 % of the drive's torque over the stiffness (friction within the gear), all joints together
//   sensor     0.1 % of the load (linearity), and steps of a thousandth of zero_drift_N: by default 1e-5 of its range
#pragma once

#include <string>
#include <vector>

#include "controller/identification/tool_fit.hpp"
#include "controller/proof/proof.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::identification {

inline constexpr double mounting_deg = 0.5;

Allowances allowances_of(double zero_drift_N) noexcept;

// What can't be found by these stations and why, in words; empty: all of it can.
std::string not_shown(const description::Cell& cell, const models::Arm& arm,
                      const std::vector<proof::Station>& stations, const Allowances& allowances);

// Precondition: there is a reading. Throws SetupError for an arm that can't be built.
ToolFit identify_tool(const description::Cell& cell, const std::vector<proof::Reading>& readings,
                      const Allowances& allowances);

// Why the result isn't to be believed; empty: nothing speaks against it.
std::string doubts(const ToolFit& fit, const Allowances& allowances);

}  // namespace proxarm::identification
