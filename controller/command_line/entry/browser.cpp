#include "controller/command_line/entry/browser.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "controller/command_line/entry/child_process.hpp"
#include "controller/live/control_socket.hpp"

namespace proxarm::command_line {
namespace {

bool has_desktop() {
  const auto set = [](const char* name) {
    const char* const value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  return isatty(STDERR_FILENO) == 1 && (set("DISPLAY") || set("WAYLAND_DISPLAY"));
}

}  // namespace

BrowserDoor::BrowserDoor(const std::string& url) {
  if (!has_desktop()) return;
  const std::filesystem::path folder = controller::default_control_path().parent_path();
  mkdir(folder.c_str(), 0700);
  const std::string file = folder / ("view-" + std::to_string(getpid()) + ".html");
  const int made = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (made < 0) return;
  file_ = file;
  const std::string text = "<!doctype html><meta http-equiv=\"refresh\" content=\"0;url=" + url + "\">\n";
  const bool whole = write(made, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(made);
  if (whole) start_child({"xdg-open", file_}, {}, ErrorStream::dropped);
}

BrowserDoor::~BrowserDoor() {
  if (!file_.empty()) unlink(file_.c_str());
}

}  // namespace proxarm::command_line
