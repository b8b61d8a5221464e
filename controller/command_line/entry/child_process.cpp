#include "controller/command_line/entry/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

extern char** environ;

namespace proxarm::command_line {

ChildProcess start_child(std::vector<std::string> words, const std::vector<int>& descriptors, ErrorStream errors) {
  constexpr int first_there = 3, above_all = 10;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (stream == STDERR_FILENO && errors == ErrorStream::shared) continue;
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  }
  // First copies all descriptors to numbers above those that the program gets, so that no descriptor is overwritten
  // before it is copied.
  std::vector<int> high;
  for (const int descriptor : descriptors) {
    high.push_back(fcntl(descriptor, F_DUPFD_CLOEXEC, above_all));
    posix_spawn_file_actions_adddup2(&actions, high.back(), first_there + static_cast<int>(high.size()) - 1);
  }
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ChildProcess child;
  child.error = posix_spawnp(&child.id, arguments.front(), &actions, nullptr, arguments.data(), environ);
  if (child.error != 0) child.id = 0;
  posix_spawn_file_actions_destroy(&actions);
  for (const int descriptor : high) close(descriptor);
  return child;
}

}  // namespace proxarm::command_line
