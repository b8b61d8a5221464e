#include "controller/command_line/trials/mass_advice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "controller/command_line/trials/mass_trial.hpp"
#include "controller/report/summary.hpp"

namespace proxarm::command_line {

using controller::hand_margin;
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

double rounded_up(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return std::ceil(value / unit * (1.0 - 1e-9)) * unit;
}

TriedAdvice tried_advice(const PreparedSession& session, double mass_kg) {
  TriedAdvice out;
  for (int tries = 0; tries < 6; ++tries, mass_kg = rounded_up(1.25 * mass_kg)) {
    std::array<char, 200> text{};
    bool steady = true;
    for (const double factor : {1.0, hand_margin}) {
      const MassTrial trial = try_mass(session, mass_kg, factor);
      if (trial.steady()) continue;
      const std::string what =
          trial.fault.empty() ? "swings: " + oscillation_text(trial.oscillation) : "is stopped by " + trial.fault;
      std::snprintf(text.data(), text.size(), "%.3g kg%s %s; ", mass_kg,
                    factor > 1.0 ? " with the stiffer and heavier hand" : "", what.c_str());
      steady = false;
      break;
    }
    out.text += text.data();
    if (!steady) continue;
    std::snprintf(text.data(), text.size(), "%.3g kg is steady for %.3g s, with the stiffer and heavier hand, too",
                  mass_kg, session.duration_s);
    out.text += text.data();
    out.mass_kg = mass_kg;
    return out;
  }
  out.text += "none of these is steady";
  return out;
}

}  // namespace proxarm::command_line
