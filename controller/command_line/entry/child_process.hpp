// Starts another program.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace proxarm::command_line {

struct ChildProcess {
  pid_t id = 0;   // of the started process; 0: the program couldn't be started
  int error = 0;  // why the program couldn't be started (errno)
};

enum class ErrorStream : bool { shared, dropped };

// Starts the program words[0] with the arguments words[1], words[2] and so on. If words[0] has no slash, the program is
// looked up on the PATH. The program's standard input and output are /dev/null, so that a reader of the caller's output
// doesn't wait for the program to end. The program gets `descriptors` as its descriptors 3, 4 and so on, and inherits
// the caller's descriptors that aren't closed on exec.
ChildProcess start_child(std::vector<std::string> words, const std::vector<int>& descriptors, ErrorStream errors);

}  // namespace proxarm::command_line
