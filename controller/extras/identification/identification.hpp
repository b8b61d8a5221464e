// Identifies the tool behind the sensor from the sensor's readings in several poses of the resting arm.
//
// The fit starts with the cell's tool, and is repeated with the tool that it found: the links' places depend on the
// gears' twist, and the twist depends on the tool. Allowances for errors:
//   mounting   0.5 degrees about each axis, both for the sensor on its flange and for the base
//   drift      the cell's sensor.zero_drift_N, from the first pose to the last
//   gears      a fifth of the difference between a pose's twist and the mean twist, because the stiffness is only known
//              that well
//   friction   for joints that move, 2 % of the drive's torque over the gear's stiffness, because of the gear's
//              friction. The allowances for gears and friction of all joints are added in squares
//   sensor     0.1 % of the load (linearity); a resolution of zero_drift_N/1000, by default 1e-5 of the range
#pragma once

#include <string>
#include <vector>

#include "controller/extras/identification/tool_fit.hpp"
#include "controller/extras/proof/proof.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::identification {

inline constexpr double mounting_deg = 0.5;

Allowances allowances_of(double zero_drift_N) noexcept;

// Returns which values readings at these stations can't determine, and why; empty: they determine all values.
std::string not_shown(const description::Cell& cell, const models::Arm& arm,
                      const std::vector<proof::Station>& stations, const Allowances& allowances);

// Returns the tool that explains the readings. Precondition: at least one reading. Throws SetupError if the arm can't
// be built.
ToolFit identify_tool(const description::Cell& cell, const std::vector<proof::Reading>& readings,
                      const Allowances& allowances);

// Returns reasons to doubt the result; empty: no reason.
std::string doubts(const ToolFit& fit, const Allowances& allowances);

}  // namespace proxarm::identification
