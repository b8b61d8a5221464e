// Runs the trials of an assessment: sessions of a cell in-process and in virtual time, without output.
#pragma once

#include "controller/extras/assessment/assessment.hpp"
#include "controller/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Runs one trial. The hand has the tightest grip of its file, and moves as the trial says. Precondition: the session is
// prepared and stable. Throws SetupError if the session can't begin.
assessment::TrialResult run_trial(const controller::PreparedSession& session, const assessment::Trial& trial);

}  // namespace proxarm::command_line
