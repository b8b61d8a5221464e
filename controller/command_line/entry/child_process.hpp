// Starts another program.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace proxarm::command_line {

struct ChildProcess {
  pid_t id = 0;   // 0: the program couldn't be started
  int error = 0;  // why not (errno)
};

enum class ErrorStream : bool { shared, dropped };

// Starts the program words[0], looked up on the PATH if it has no slash, with the arguments that follow. The program's
// standard input and output are /dev/null, so that a reader of the caller's output doesn't wait for the program. It
// finds `descriptors` as 3, 4 and so on, and inherits the caller's other descriptors that aren't closed on exec.
ChildProcess start_child(std::vector<std::string> words, const std::vector<int>& descriptors, ErrorStream errors);

}  // namespace proxarm::command_line
