// Computes the inertia that `tune` advises for a tool that is moved and turned at once. By the eigenvalues of the pose
// loop, that inertia is stable with margins in all poses to which the hand leads the arm.
#pragma once

#include <optional>

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// The smallest stable inertias as the hand feels them (kg m²), the load behind the sensor included. Absent: no inertia
// is stable with the session's mass.
struct SmallestInertias {
  std::optional<double> at_start, everywhere;
  // As `everywhere`, but with the margins of controller::with_margins for the hand's translation and rotation.
  std::optional<double> with_margins;
};
// Computes these inertias. Precondition: turned_model() returns a model for the session.
SmallestInertias smallest_inertias(const controller::PreparedSession& session);

}  // namespace proxarm::command_line
