#include <chrono>
#include <cstdio>
#include <thread>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/entry/exit_status.hpp"
#include "controller/live/control_socket.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

// Time between two lines of --watch. A person can't read much faster.
constexpr auto watch_every = std::chrono::milliseconds(250);

}  // namespace

int status_command(const StatusOptions& options) {
  const std::filesystem::path path = options.control.empty() ? controller::default_control_path() : options.control;
  for (bool first = true;; first = false) {
    std::string answer;
    try {
      answer = controller::ask_control_socket(path, options.json ? "status" : "status text");
    } catch (const description::SetupError& error) {
      const bool suspended = error.found().starts_with("no answer");
      if (first || suspended) throw;
      return fine;  // the session has ended
    }
    if (!answer.starts_with(controller::agreed)) throw description::SetupError({.message = answer});
    std::printf("%s\n", answer.c_str() + controller::agreed.size());
    std::fflush(stdout);
    if (!options.watch) return fine;
    std::this_thread::sleep_for(watch_every);
  }
}

}  // namespace proxarm::command_line
