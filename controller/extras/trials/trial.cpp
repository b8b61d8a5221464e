#include "controller/extras/trials/trial.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include "controller/library/simulated_loop.hpp"
#include "controller/report/summary.hpp"

namespace proxarm::command_line {

Trial try_out(controller::PreparedSession session, double hand_factor) {
  session.settings.horizon_s = 0.0;
  session.settings.passivity = controller::Passivity::observe;
  session.hand.mass_kg *= hand_factor;
  session.hand.stiffness_N_per_m *= hand_factor;
  session.hand.inertia_kg_m2 *= hand_factor;
  session.hand.turning_stiffness_Nm_per_rad *= hand_factor;
  for (description::Grip& grip : session.hand.grips) grip.stiffness_N_per_m *= hand_factor;
  controller::SummaryBuilder summary({.period_s = session.settings.period_s, .passivity = true});
  Trial out;
  out.fault = controller::run_quietly(session, [&](controller::CycleRecord record, const sim::Truth& truth) {
                controller::add_truth(record, truth);
                summary.add(record);
              }).fault;
  out.oscillation = summary.finish().oscillation.value_or(controller::Oscillation{});
  return out;
}

double rounded_up(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return std::ceil(value / unit * (1.0 - 1e-9)) * unit;
}

namespace {
TriedAdvice try_from(controller::PreparedSession session, double controller::SessionSettings::*felt, double value,
                     const char* unit) {
  TriedAdvice out;
  for (int tries = 0; tries < 6; ++tries, value = rounded_up(1.25 * value)) {
    session.settings.*felt = value;
    std::array<char, 200> text{};
    bool steady = true;
    for (const double factor : {1.0, controller::hand_margin}) {
      const Trial trial = try_out(session, factor);
      if (trial.steady()) continue;
      const std::string what =
          trial.fault.empty() ? "swings: " + oscillation_text(trial.oscillation) : "is stopped by " + trial.fault;
      std::snprintf(text.data(), text.size(), "%.3g %s%s %s; ", value, unit,
                    factor > 1.0 ? " with the stiffer and heavier hand" : "", what.c_str());
      steady = false;
      break;
    }
    out.text += text.data();
    if (!steady) continue;
    std::snprintf(text.data(), text.size(), "%.3g %s is steady for %.3g s, with the stiffer and heavier hand, too",
                  value, unit, session.duration_s);
    out.text += text.data();
    out.steady = value;
    return out;
  }
  out.text += "none of these is steady";
  return out;
}
}  // namespace

TriedAdvice tried_mass(const controller::PreparedSession& session, double mass_kg) {
  return try_from(session, &controller::SessionSettings::mass_kg, mass_kg, "kg");
}

TriedAdvice tried_inertia(const controller::PreparedSession& session, double inertia_kg_m2) {
  return try_from(session, &controller::SessionSettings::rotational_inertia_kg_m2, inertia_kg_m2, "kg m²");
}

}  // namespace proxarm::command_line
