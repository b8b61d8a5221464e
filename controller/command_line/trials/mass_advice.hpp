// The mass that `tune` and `new-cell` advise before it is tried (trial.hpp). By the eigenvalues of the closed loop it
// is stable with margins.
#pragma once

#include <optional>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Returns the felt mass, handle included, at which the loop is just stable with the margins of
// controller::with_margins: also for a stiffer and heavier hand, and for a longer delay.
std::optional<double> smallest_with_margins(const controller::HandModel& hand, const controller::LoopModel& loop);

// Returns the least of controller::tried_dampings with which the mass with margins is at most half of the mass without
// damping; nullopt if there is none. It is at most 20 Ns/m: at 0.2 m/s that is 4 N, which a hand takes for a heavier
// handle.
inline constexpr double most_for_comfort_Ns_per_m = 20.0;
std::optional<controller::DampedMass> worthwhile_damping(const controller::HandModel& hand,
                                                         const controller::LoopModel& loop);

}  // namespace proxarm::command_line
