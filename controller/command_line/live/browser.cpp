#include "controller/command_line/live/browser.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>

#include "controller/command_line/live/control_socket.hpp"

extern char** environ;

namespace proxarm::command_line {
namespace {

bool has_desktop() {
  const auto set = [](const char* name) {
    const char* const value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  return isatty(STDERR_FILENO) == 1 && (set("DISPLAY") || set("WAYLAND_DISPLAY"));
}

void open_with_desktop(std::string file) {
  std::string program = "xdg-open";
  std::array<char*, 3> words{program.data(), file.data(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  }
  pid_t opener = 0;
  (void)posix_spawnp(&opener, program.c_str(), &actions, nullptr, words.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
}

}  // namespace

BrowserDoor::BrowserDoor(const std::string& url) {
  if (!has_desktop()) return;
  const std::filesystem::path folder = default_control_path().parent_path();
  mkdir(folder.c_str(), 0700);
  const std::string file = folder / ("view-" + std::to_string(getpid()) + ".html");
  const int made = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (made < 0) return;
  file_ = file;
  const std::string text = "<!doctype html><meta http-equiv=\"refresh\" content=\"0;url=" + url + "\">\n";
  const bool whole = write(made, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(made);
  if (whole) open_with_desktop(file_);
}

BrowserDoor::~BrowserDoor() {
  if (!file_.empty()) unlink(file_.c_str());
}

}  // namespace proxarm::command_line
