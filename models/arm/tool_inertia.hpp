// Computes mass and inertia of everything behind the force sensor, about the rendered point T along T's axes. The
// sensor doesn't measure the force that accelerates this mass, so the hand feels this inertia in full, whatever the
// controller renders.
#pragma once

#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::models {

struct ToolInertia {
  double mass_kg = 0.0;
  Vec3 centre_T_m = Vec3::Zero();     // vector from T to the centre of mass
  Mat3 about_T_kg_m2 = Mat3::Zero();  // inertia about T (with Steiner's term)
  double largest_kg_m2 = 0.0;         // largest inertia about any axis through T
};

// Returns the cell's six numbers as a matrix: the inertia about the tool's centre of mass, along S's axes.
Mat3 inertia_about_centre_S(const description::ToolDescription& tool) noexcept;

ToolInertia tool_inertia(const description::ToolDescription& tool);
// Returns the ToolInertia without `largest_kg_m2`. For the cycle: doesn't allocate, lock or throw.
ToolInertia tool_about_T(const description::ToolDescription& tool) noexcept;

}  // namespace proxarm::models
