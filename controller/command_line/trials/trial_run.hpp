// Trials of an assessment: sessions of a cell in-process and in virtual time, nothing printed and nothing drawn.
#pragma once

#include "controller/assessment/assessment.hpp"
#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// One trial of a session that is prepared and stable. Its hand grips as its file says (the tightest), but goes where
// the trial says. Throws SetupError where the session can't begin.
assessment::TrialResult run_trial(const PreparedSession& session, const assessment::Trial& trial);

}  // namespace proxarm::command_line
