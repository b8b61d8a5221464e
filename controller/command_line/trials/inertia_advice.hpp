// The inertia that `tune` advises for a tool that is led and turned at once: stable with margins by the pose loop's
// eigenvalues, in all poses that the hand leads to.
#pragma once

#include <optional>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Felt, what hangs behind the sensor included; absent: none is stable with the session's mass.
struct SmallestInertias {
  std::optional<double> at_start, everywhere;
  std::optional<double> with_margins;  // everywhere, with those of controller::with_margins in place and in rotation
};
// Precondition: the session has a turned_model().
SmallestInertias smallest_inertias(const PreparedSession& session);

}  // namespace proxarm::command_line
