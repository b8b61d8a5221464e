// `proxarm run --bus vcan0`: the controller on CAN interfaces of the kernel, in real time.
#pragma once

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/sessions/black_box_keeper.hpp"

namespace proxarm::command_line {

// Returns the exit status; throws SetupError while nothing has moved. Refuses interfaces that aren't virtual: limits
// and supervision that would make it safe to stand next to a moving arm aren't there yet.
int run_on_interfaces(const PreparedSession& session, const RunOptions& options, BlackBoxKeeper& keeper);

}  // namespace proxarm::command_line
