// `proxarm prove --bus-loss`: silences the controller on purpose, against a simulated arm or on interfaces.
#pragma once

#include <filesystem>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Prints how and when each drive on CAN stopped, and adds that to `file`, the cell's proof. Exit status 1: a drive
// didn't stop within supervision.bus_loss_stop_s. `arm` is the session of the simulated arm.
int prove_bus_loss(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options,
                   const std::filesystem::path& file);

}  // namespace proxarm::command_line
