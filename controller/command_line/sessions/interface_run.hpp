// Runs `proxarm run --bus can0`: the controller on CAN interfaces of the kernel, in real time.
#pragma once

#include "controller/command_line/sessions/black_box_keeper.hpp"
#include "controller/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Runs the session and returns the exit status. Throws SetupError only before the arm moves. Real interfaces need
// consent (live/hardware_consent.hpp).
int run_on_interfaces(const controller::PreparedSession& session, const controller::RunOptions& options,
                      BlackBoxKeeper& keeper);

}  // namespace proxarm::command_line
