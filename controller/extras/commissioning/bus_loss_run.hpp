// Runs `proxarm prove --bus-loss`: silences the controller on purpose, with a simulated arm or an arm on interfaces,
// and finds how the drives stop.
#pragma once

#include <filesystem>

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Prints how and when each drive on CAN stopped, and adds that to the cell's proof, `file`. `arm` is the session of the
// simulated arm. Returns the exit status, which is 1 if a drive didn't stop within supervision.bus_loss_stop_s.
int prove_bus_loss(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                   const controller::RunOptions& options, const std::filesystem::path& file);

}  // namespace proxarm::command_line
