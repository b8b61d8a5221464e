// A Unix socket through which a running session takes orders and changes from its owner. A client sends one line, of at
// most 1024 bytes, and gets one line back. A line is an order, such as "hold", or changes "NAME=VALUE", separated by
// tabs.
//
// The socket has mode 0600 in a folder of mode 0700. The kernel reports the client's user (SO_PEERCRED), so other users
// are refused even on a file system without modes.
//
// Orders are answered whatever other clients do; changes take longer to judge and have their own thread. Sixteen
// connections are served at once, each for two seconds; one more replaces the oldest. If the process has no file
// descriptors left, four reserved ones are used.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace proxarm::command_line {

// Give the answers. If a handler throws, the exception's text is the answer.
struct ControlHandlers {
  // An order, answered at once in the socket's thread; nullopt: the line isn't an order.
  std::function<std::optional<std::string>(const std::string& line)> order;
  // All other lines, one after the other, in a second thread.
  std::function<std::string(const std::string& line)> change;
};

class ControlSocket {
 public:
  // Makes the folder if necessary. Throws SetupError if others may enter the folder or the path is taken.
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

// Answers begin with this if the session complies.
inline constexpr std::string_view agreed = "ok: ";

// Sends a line and returns the answer. Throws SetupError if no session listens.
std::string ask_control_socket(const std::filesystem::path& path, const std::string& line);

// Default path of `proxarm set`: proxarm/control in the user's runtime folder, or in /tmp/proxarm-UID.
std::filesystem::path default_control_path();

}  // namespace proxarm::command_line
