#include "controller/command_line/trials/mass_advice.hpp"

#include <algorithm>

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

}  // namespace proxarm::command_line
