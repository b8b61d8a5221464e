// Computes the mass that `tune` and `new-cell` advise; trial.hpp then tries it. By the eigenvalues of the closed loop,
// that mass is stable with margins.
#pragma once

#include <optional>

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Returns the smallest felt mass, handle included, with which the loop is stable with the margins of
// controller::with_margins: also with a stiffer and heavier hand, and with a longer delay.
std::optional<double> smallest_with_margins(const controller::HandModel& hand, const controller::LoopModel& loop);

// Returns the smallest of controller::tried_dampings with which smallest_with_margins() is at most half of what it is
// without added damping; nullopt if there is none. The damping is at most 20 Ns/m: at 0.2 m/s that gives 4 N, which a
// hand still takes for a heavier handle, not for resistance.
inline constexpr double most_for_comfort_Ns_per_m = 20.0;
std::optional<controller::DampedMass> worthwhile_damping(const controller::HandModel& hand,
                                                         const controller::LoopModel& loop);

}  // namespace proxarm::command_line
