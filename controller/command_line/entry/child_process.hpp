// Starts another program.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace proxarm::command_line {

struct ChildProcess {
  pid_t id = 0;   // 0: it couldn't be started,
  int error = 0;  // for this reason (errno)
};

enum class ErrorStream : bool { shared, dropped };

// The program (looked up on the PATH unless it has a slash) and its arguments. Its standard input and output are
// /dev/null: who reads the caller's output to its end must not wait for it. It finds `descriptors` as its 3, 4 and so
// on, whatever their numbers are here; of the caller's others it has those that aren't closed on exec.
ChildProcess start_child(std::vector<std::string> words, const std::vector<int>& descriptors, ErrorStream errors);

}  // namespace proxarm::command_line
