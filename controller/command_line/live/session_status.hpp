// The status of a running session: the answer to "status" on its socket. It is read from the black box's memory while
// the cycle writes there, so the cycle isn't involved.
#pragma once

#include <optional>
#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"

namespace proxarm::command_line {

// Answers "status" with a line of JSON, {"version": 1, "phase": "rendering", …}: docs/files.md#the-status-of-a-session;
// answers "status text" with a line for people. nullopt: the line asks for something else. Any thread may call it.
std::optional<std::string> session_status(const std::string& line, const controller::BoxReader& box,
                                          const PreparedSession& session);

}  // namespace proxarm::command_line
