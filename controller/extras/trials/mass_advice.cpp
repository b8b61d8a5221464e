#include "controller/extras/trials/mass_advice.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::command_line {

using controller::HandModel;
using controller::LoopModel;

std::optional<double> smallest_with_margins(const HandModel& hand, const LoopModel& loop) {
  double worst = 0.0;
  const bool all = controller::with_margins(hand, loop, [&](const HandModel& other, const LoopModel& slower) {
    const auto mass = controller::smallest_stable_mass(other, slower);
    if (mass) worst = std::max(worst, *mass + slower.handle_mass_kg);
    return mass.has_value();
  });
  return all ? std::optional<double>(worst) : std::nullopt;
}

std::optional<controller::DampedMass> worthwhile_damping(const HandModel& hand, const LoopModel& loop) {
  constexpr double worth = 0.5;  // as a share of the mass without added damping
  const auto smallest = [&](const LoopModel& damped) -> std::optional<double> {
    if (damped.damping_Ns_per_m > most_for_comfort_Ns_per_m) return std::nullopt;
    return smallest_with_margins(hand, damped);
  };
  const std::optional<double> without = smallest_with_margins(hand, loop);
  return controller::least_damping(loop, without ? worth * *without : HUGE_VAL, smallest);
}

}  // namespace proxarm::command_line
