// Is a mass as steady on the simulated arm as the stability check says? What `tune` asks before it advises one.
#pragma once

#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/report/oscillation.hpp"

namespace proxarm::command_line {

struct MassTrial {
  controller::Oscillation oscillation;
  std::string fault;  // that ended it; empty: none
  [[nodiscard]] bool steady() const noexcept { return !oscillation.lasts && fault.empty(); }
};

// The session with that mass, nothing sent ahead and nothing damped, and with a hand so many times as stiff and as
// heavy. Throws SetupError where it can't begin.
MassTrial try_mass(PreparedSession session, double felt_mass_kg, double hand_factor);

}  // namespace proxarm::command_line
