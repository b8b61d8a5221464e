// Is a mass, or an inertia, as steady on the simulated arm as the stability check says? What `tune` asks before it
// advises one.
#pragma once

#include <optional>
#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/report/oscillation.hpp"

namespace proxarm::command_line {

struct Trial {
  controller::Oscillation oscillation;
  std::string fault;  // that ended it; empty: none
  [[nodiscard]] bool steady() const noexcept { return !oscillation.lasts && fault.empty(); }
};

// The session with nothing sent ahead and nothing damped, and with a hand so many times as stiff and as heavy. Throws
// SetupError where it can't begin.
Trial try_out(PreparedSession session, double hand_factor);

struct TriedAdvice {
  std::optional<double> steady;  // the first that is; none: of six none was
  std::string text;
};
// What comes of a felt mass, or a felt inertia, on the simulated arm. Larger ones are tried where it isn't steady, a
// quarter more each time.
TriedAdvice tried_mass(const PreparedSession& session, double mass_kg);
TriedAdvice tried_inertia(const PreparedSession& session, double inertia_kg_m2);

// Two digits, not less.
double rounded_up(double value);

}  // namespace proxarm::command_line
