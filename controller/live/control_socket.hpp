// Opens a Unix socket through which a running session takes orders and changes from its owner. A client sends one line
// of at most 1024 bytes, and gets one line back. A line holds one order, such as "hold", or one or more changes
// "NAME=VALUE", separated by tabs.
//
// The socket has mode 0600 in a folder of mode 0700. The kernel reports the client's user (SO_PEERCRED), so users other
// than the owner and root are refused even on a file system that has no modes.
//
// Changes take longer to judge than orders, so they are judged in a second thread, and no change delays the answer to
// an order. At most sixteen connections are served at once, each for two seconds. A seventeenth connection ends the
// oldest one. If the process has no file descriptors left, the socket uses four reserved ones.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace proxarm::controller {

// The functions that answer a client's line. If a handler throws, the exception's text is the answer.
struct ControlHandlers {
  // Answers an order at once, in the socket's thread; nullopt: the line isn't an order.
  std::function<std::optional<std::string>(const std::string& line)> order;
  // Answers all other lines, one after the other, in a second thread.
  std::function<std::string(const std::string& line)> change;
};

class ControlSocket {
 public:
  // Makes the socket's folder if it doesn't exist. Throws SetupError if other users may enter the folder, or if the
  // path is in use.
  ControlSocket(const std::filesystem::path& path, ControlHandlers handlers);
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;
  ~ControlSocket();  // removes the socket's file

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Throws SetupError where ControlSocket would. Call it before a bus is opened.
void require_control_path(const std::filesystem::path& path);

// The beginning of an answer if the session accepts the line.
inline constexpr std::string_view agreed = "ok: ";

// Sends a line and returns the answer. Throws SetupError if no session listens.
std::string ask_control_socket(const std::filesystem::path& path, const std::string& line);

// Returns the default path of the socket: proxarm/control in the user's runtime folder, or /tmp/proxarm-UID/control.
std::filesystem::path default_control_path();

}  // namespace proxarm::controller
