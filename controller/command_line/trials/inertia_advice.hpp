// The inertia that `tune` advises for a tool that is moved and turned at once. By the eigenvalues of the pose loop it
// is stable with margins in all poses that the hand leads to.
#pragma once

#include <optional>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Felt inertias (kg m²), load behind the sensor included; absent: no inertia is stable with the session's mass.
struct SmallestInertias {
  std::optional<double> at_start, everywhere;
  std::optional<double> with_margins;  // as `everywhere`, with the margins of controller::with_margins for the hand's
                                       // translation and rotation
};
// Precondition: the session has a turned_model().
SmallestInertias smallest_inertias(const PreparedSession& session);

}  // namespace proxarm::command_line
