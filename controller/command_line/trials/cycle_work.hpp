// Counts what a session's cycles compute besides 𝒢, and what they can skip.
#pragma once

#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/motion/motion_work.hpp"

namespace proxarm::command_line {

// Runs the session on the simulated arm and counts. Throws SetupError if the session can't begin.
controller::MotionWork count_work(const PreparedSession& session);

std::string work_text(const PreparedSession& session, const controller::MotionWork& work);

}  // namespace proxarm::command_line
