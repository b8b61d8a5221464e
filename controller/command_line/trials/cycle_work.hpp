// What the cycles of a session compute around 𝒢, and what they can leave out, in counts.
#pragma once

#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/motion/motion_work.hpp"

namespace proxarm::command_line {

// Of a session of the simulated arm. Throws SetupError where it can't begin.
controller::MotionWork count_work(const PreparedSession& session);

// The same in words, a line for each stage.
std::string work_text(const PreparedSession& session, const controller::MotionWork& work);

}  // namespace proxarm::command_line
