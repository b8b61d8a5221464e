// The zero of the force sensor: a session compares its tare with it, and keeps the new one afterwards.
#pragma once

#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/preparation/zero_file.hpp"
#include "controller/cycle/cycle.hpp"

namespace proxarm::command_line {

// Gives the session the zero kept beside its cell. Without one, a simulated sensor keeps the zero that it has, and a
// real sensor's is taken as 0.
void know_zero(PreparedSession& session, const RunOptions& options);

// Returns the zero that this cycle has tared and followed.
ZeroFile zero_of(const PreparedSession& session, const controller::Cycle& cycle, bool real_arm);

// Keeps the zero after a session without a fault on a real arm. With --accept-force it isn't kept, since it may contain
// a hand's force.
void keep_zero(const PreparedSession& session, const RunOptions& options, const std::vector<std::string>& interfaces,
               const controller::Cycle& cycle);

}  // namespace proxarm::command_line
