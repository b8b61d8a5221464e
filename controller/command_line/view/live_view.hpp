// Shows a running session until the session ends the view.
//
// The session (sessions/view_process.hpp) starts this process with two descriptors: the memory of its black box, mapped
// for reading, and a socket for JSON. First one line goes each way: what to show, and the URL or why there is none.
// Later lines from the session tell how it ended. When the socket closes, this process ends.
#pragma once

namespace proxarm::command_line {

// Returns the exit status.
int live_view(int memory, int session);

}  // namespace proxarm::command_line
