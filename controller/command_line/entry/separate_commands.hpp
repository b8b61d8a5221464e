// The commands that are separate programs in proxarm's folder: proxarm stays quick to build and small in memory.
#pragma once

#include <string>
#include <vector>

namespace proxarm::command_line {

struct SeparateCommand {
  std::string name;     // as in `proxarm NAME`
  std::string text;     // its line in the help
  std::string program;  // file name; in a source tree `./dev NAME` builds it
};

// In the order of the help.
const std::vector<SeparateCommand>& separate_commands();

// Returns the help's line of the separate command `name`, which must exist.
const std::string& text_of(const std::string& name);

// Replaces this process by the separate program that carries out words[1], and doesn't return. Returns if words[1] is
// no such command. Throws SetupError if the program isn't there.
void become_separate(std::vector<char*> words);

}  // namespace proxarm::command_line
