// The mass that `tune` and `new-cell` advise, before it is tried (trial.hpp): stable with margins by the closed loop's
// eigenvalues.
#pragma once

#include <optional>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Felt mass, handle included, at which the loop is just stable with the margins of controller::with_margins: the worst
// of the hand as described and of one that is stiffer and heavier, and of the delay as it is and longer.
std::optional<double> smallest_with_margins(const controller::HandModel& hand, const controller::LoopModel& loop);

// A damping that is worth its price: the least of controller::tried_dampings with which the mass with margins is at
// most half of that without, if there is one; at most 20 Ns/m, which is 4 N at 0.2 m/s, what a hand takes for a heavier
// handle.
inline constexpr double most_for_comfort_Ns_per_m = 20.0;
std::optional<controller::DampedMass> worthwhile_damping(const controller::HandModel& hand,
                                                         const controller::LoopModel& loop);

}  // namespace proxarm::command_line
