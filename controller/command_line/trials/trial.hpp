// Tries a mass or an inertia on the simulated arm, to confirm the stability check before `tune` advises the value.
#pragma once

#include <optional>
#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/report/oscillation.hpp"

namespace proxarm::command_line {

struct Trial {
  controller::Oscillation oscillation;
  std::string fault;  // the fault that ended the trial; empty: none
  [[nodiscard]] bool steady() const noexcept { return !oscillation.lasts && fault.empty(); }
};

// Runs the session without lookahead and without added damping. The hand's stiffness and mass are multiplied by
// hand_factor. Throws SetupError if the session can't begin.
Trial try_out(PreparedSession session, double hand_factor);

struct TriedAdvice {
  std::optional<double> steady;  // the first steady value; absent: none of the six tried was steady
  std::string text;
};
// Tries a felt mass or a felt inertia on the simulated arm. While it isn't steady, tries values that grow by a quarter.
TriedAdvice tried_mass(const PreparedSession& session, double mass_kg);
TriedAdvice tried_inertia(const PreparedSession& session, double inertia_kg_m2);

// Rounds up to two significant digits.
double rounded_up(double value);

}  // namespace proxarm::command_line
