// How a running session is: the answer to "status" on its socket, read from the black box's memory while the cycle
// writes there. The cycle isn't involved.
#pragma once

#include <optional>
#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"

namespace proxarm::command_line {

// To "status" a line of JSON, {"version": 1, "phase": "rendering", …}: docs/files.md#the-status-of-a-session; to
// "status text" a line for people. Nothing: the line asks for something else. Any thread.
std::optional<std::string> session_status(const std::string& line, const controller::BoxReader& box,
                                          const PreparedSession& session);

}  // namespace proxarm::command_line
