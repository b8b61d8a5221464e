// `proxarm view DIR`: plays a recorded session or a black box until Ctrl-C.
//
// Every page has its own place in the record, and requests what it shows:
//   {"at": INDEX}             the moment of that cycle
//   {"frames": INDEX}         {"frames": {"at": INDEX, "list": [{bus, id, bytes, from, words}, …]}}
//   {"spectrum": INDEX}       {"spectrum": {"at": INDEX, …}}: the handle's vibration of the second before
//   (vibration.hpp)
//   {"window": [FROM, TO]}    a history of at most 800 rows
#pragma once

#include "controller/command_line/view/view_options.hpp"

namespace proxarm::command_line {

// Returns the exit status; throws SetupError.
int play_view(const ViewOptions& options);

}  // namespace proxarm::command_line
