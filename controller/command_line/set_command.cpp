#include <cstdio>
#include <sstream>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/entry/exit_status.hpp"
#include "controller/live/control_socket.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::command_line {
namespace {

// Returns one line with all changes. The session makes all changes of a line, or none.
std::string line_of(const std::vector<std::string>& changes) {
  std::string line;
  for (const std::string& change : changes) {
    if (change.empty() || change.find('\t') != std::string::npos) {
      throw description::SetupError({.found = description::in_quotes(change), .expected = "NAME=VALUE"});
    }
    line += (line.empty() ? "" : "\t") + change;
  }
  return line;
}

}  // namespace

int set_command(const SetOptions& options) {
  const std::filesystem::path path = options.control.empty() ? controller::default_control_path() : options.control;
  const std::string answer = controller::ask_control_socket(path, line_of(options.changes));
  if (!answer.starts_with(controller::agreed)) {
    std::fprintf(stderr, "proxarm: %s%s\n", answer.c_str(),
                 options.changes.size() > 1 ? "; none of the changes was made" : "");
    return set_up_mistake;
  }
  std::istringstream done(answer.substr(controller::agreed.size()));
  for (std::string change; std::getline(done, change, '\t');) std::printf("ok: %s\n", change.c_str());
  return fine;
}

}  // namespace proxarm::command_line
