// Reads the force sensor's zero before a session, which compares its tare with it, and writes the new zero after the
// session.
#pragma once

#include <string>
#include <vector>

#include "controller/cycle/cycle.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/zero_file.hpp"

namespace proxarm::command_line {

// Puts the zero that is kept beside the cell into the session's settings. If none is kept, a real sensor's zero is
// taken as 0, and for a simulated sensor the settings stay unchanged.
void know_zero(controller::PreparedSession& session, const controller::RunOptions& options);

// Returns the zero that the cycle has tared, with the drift that it has followed since.
controller::ZeroFile zero_of(const controller::PreparedSession& session, const controller::Cycle& cycle, bool real_arm);

// Writes the zero beside the cell after a session on a real arm that rendered and ended without a fault. With
// --accept-force the zero isn't written, because it may contain a hand's force.
void keep_zero(const controller::PreparedSession& session, const controller::RunOptions& options,
               const std::vector<std::string>& interfaces, const controller::Cycle& cycle);

}  // namespace proxarm::command_line
