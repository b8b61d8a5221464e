// `proxarm prove --bus-loss`: the controller falls silent on purpose, against a simulated arm or on interfaces.
#pragma once

#include <filesystem>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Prints how each drive on CAN stopped and when, and keeps that in `file`, the cell's proof, beside what is there. Exit
// status: 1 where a drive doesn't stop within what the cell says (supervision.bus_loss_stop_s). `arm`: of a simulated
// one.
int prove_bus_loss(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options,
                   const std::filesystem::path& file);

}  // namespace proxarm::command_line
