// Runs `proxarm view DIR`: plays a recorded session or a black box until Ctrl-C.
//
// Each page has its own time in the record, and requests the cycles that it shows. The requests, each with its answer:
//   {"at": INDEX}             the moment of that cycle
//   {"frames": INDEX}         {"frames": {"at": INDEX, "list": [{bus, id, bytes, from, words}, …]}}
//   {"spectrum": INDEX}       {"spectrum": {"at": INDEX, …}}, the handle's vibration in the second before that cycle
//                             (vibration.hpp)
//   {"window": [FROM, TO]}    a history of at most 800 rows
#pragma once

#include "controller/extras/view/program/view_options.hpp"

namespace proxarm::command_line {

// Runs the view and returns the exit status. Throws SetupError.
int play_view(const ViewOptions& options);

}  // namespace proxarm::command_line
