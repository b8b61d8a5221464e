// Runs the view's process, which shows a running session until the session ends the view.
//
// The session (sessions/view_process.hpp) starts the view's process with two descriptors: the memory of the session's
// black box, which is mapped for reading only, and a socket for lines of JSON. First the session sends what to show,
// and the view's process answers with its URL or with an error. Later the session sends margins to instability, and how
// it ended. When the socket closes, the view's process ends.
#pragma once

namespace proxarm::command_line {

// Runs until the socket closes. `memory` and `session` are the two descriptors. Returns the exit status.
int live_view(int memory, int session);

}  // namespace proxarm::command_line
