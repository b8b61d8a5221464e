// The zero of the force sensor: what a session holds its tare against, and what is kept of it afterwards.
#pragma once

#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/preparation/zero_file.hpp"
#include "controller/cycle/cycle.hpp"

namespace proxarm::command_line {

// Gives the session the zero that is kept beside its cell. Where none is, a simulated sensor has its own, and a real
// one is expected to have none.
void know_zero(PreparedSession& session, const RunOptions& options);

// As this cycle has tared and followed it.
ZeroFile zero_of(const PreparedSession& session, const controller::Cycle& cycle, bool real_arm);

// After a session on a real arm that found nothing wrong: its zero, as it was followed, is kept. With --accept-force it
// isn't, since a hand may be in it.
void keep_zero(const PreparedSession& session, const RunOptions& options, const std::vector<std::string>& interfaces,
               const controller::Cycle& cycle);

}  // namespace proxarm::command_line
