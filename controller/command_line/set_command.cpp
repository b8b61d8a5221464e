#include <cstdio>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/control_socket.hpp"
#include "controller/command_line/exit_status.hpp"

namespace proxarm::command_line {

int set_command(const SetOptions& options) {
  const std::filesystem::path path = options.control.empty() ? default_control_path() : options.control;
  for (const std::string& change : options.changes) {
    const std::string answer = ask_control_socket(path, change);
    const bool refused = answer.rfind("ok: ", 0) != 0;
    std::fprintf(refused ? stderr : stdout, "%s%s\n", refused ? "proxarm: " : "", answer.c_str());
    if (refused) return set_up_mistake;
  }
  return fine;
}

}  // namespace proxarm::command_line
