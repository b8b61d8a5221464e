// Mass and inertia of everything behind the force sensor, about the rendered point T along T's axes. The force that
// accelerates it doesn't reach the sensor, so the hand feels this inertia in full, whatever the controller renders.
#pragma once

#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::models {

struct ToolInertia {
  double mass_kg = 0.0;
  Vec3 centre_T_m = Vec3::Zero();     // from T to the centre of mass
  Mat3 about_T_kg_m2 = Mat3::Zero();  // including Steiner's term
  double largest_kg_m2 = 0.0;         // about any axis through T
};

// The cell's six numbers as a matrix: about the tool's centre of mass, along S's axes.
Mat3 inertia_about_centre_S(const description::ToolDescription& tool) noexcept;

ToolInertia tool_inertia(const description::ToolDescription& tool);
// The same without `largest_kg_m2`, for the cycle: neither allocates, locks nor throws.
ToolInertia tool_about_T(const description::ToolDescription& tool) noexcept;

}  // namespace proxarm::models
