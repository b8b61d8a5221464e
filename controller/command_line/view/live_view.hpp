// Shows a session that runs, for as long as it wants to be shown.
//
// The session (sessions/view_process.hpp) starts this process with two descriptors: the memory of its black box, which
// is mapped for reading, and a socket on which JSON goes, a line each way at first: what to show, and the URL or why
// there is none. Later lines of the session tell how it ended; when the socket falls shut, this process ends.
#pragma once

namespace proxarm::command_line {

// Returns the exit status.
int live_view(int memory, int session);

}  // namespace proxarm::command_line
