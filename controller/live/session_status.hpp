// Returns the status of a running session, which is the answer to "status" on the session's socket. The status is read
// from the black box's memory while the cycle writes there, so the cycle does no work for it.
#pragma once

#include <optional>
#include <string>

#include "controller/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"

namespace proxarm::controller {

// Answers "status" with a line of JSON, {"version": 1, "phase": "rendering", …}
// (docs/reference/files.md#the-status-of-a-session), and "status text" with a line for people. Returns nullopt if the
// line asks for something else. Any thread may call this function.
std::optional<std::string> session_status(const std::string& line, const BoxReader& box,
                                          const PreparedSession& session);

}  // namespace proxarm::controller
