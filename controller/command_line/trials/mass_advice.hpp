// The mass that `tune` and `new-cell` advise, before it is tried (trial.hpp): stable with margins by the closed loop's
// eigenvalues.
#pragma once

#include <optional>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Felt mass, handle included, at which the loop is just stable with the margins of controller::with_margins: the worst
// of the hand as described and of one that is stiffer and heavier, and of the delay as it is and longer.
std::optional<double> smallest_with_margins(const controller::HandModel& hand, const controller::LoopModel& loop);

}  // namespace proxarm::command_line
