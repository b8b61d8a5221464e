// Tries a mass or an inertia on the simulated arm before `tune` advises it, to confirm the stability check.
#pragma once

#include <optional>
#include <string>

#include "controller/preparation/prepared_session.hpp"
#include "controller/report/oscillation.hpp"

namespace proxarm::command_line {

struct Trial {
  controller::Oscillation oscillation;
  std::string fault;  // the fault that ended the trial; empty: none
  [[nodiscard]] bool steady() const noexcept { return !oscillation.lasts && fault.empty(); }
};

// Runs the session without lookahead and without the damping that passivity adds. The hand's stiffness and mass are
// multiplied by hand_factor. Throws SetupError if the session can't begin.
Trial try_out(controller::PreparedSession session, double hand_factor);

struct TriedAdvice {
  std::optional<double> steady;  // the first value that was steady; absent: none of the six tried values was
  std::string text;
};
// Try a felt mass or a felt inertia on the simulated arm. Until a value is steady, the next value is a quarter larger.
TriedAdvice tried_mass(const controller::PreparedSession& session, double mass_kg);
TriedAdvice tried_inertia(const controller::PreparedSession& session, double inertia_kg_m2);

// Returns the value rounded up to two significant digits.
double rounded_up(double value);

}  // namespace proxarm::command_line
