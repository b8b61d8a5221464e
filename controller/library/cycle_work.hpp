// Counts what a session's cycles compute besides 𝒢, and what they can skip.
#pragma once

#include <string>

#include "controller/motion/motion_work.hpp"
#include "controller/preparation/prepared_session.hpp"

namespace proxarm::controller {

// Runs the session on the simulated arm and counts. Throws SetupError if the session can't begin.
MotionWork count_work(const PreparedSession& session);

std::string work_text(const PreparedSession& session, const MotionWork& work);

}  // namespace proxarm::controller
