// A session's ear: a Unix socket that takes a line and answers with one, for its owner alone. A line is an order, such
// as "hold", or changes "NAME=VALUE", several of them with a tab between two.
//
// The socket has mode 0600 in a folder of mode 0700, and who connects is asked of the kernel (SO_PEERCRED): another
// user is turned away even where a file system knows no modes. It is no network port. Lines are at most 1024 bytes.
//
// An order is answered whatever other clients do. Sixteen connections are served at once; one more takes the place of
// the oldest, and each has two seconds. What takes longer to judge than an order waits in a thread of its own. Where
// the process has no file descriptors left for connections, four that were kept for that are used.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace proxarm::command_line {

// What gives the answers. Each may throw; the text is the answer then.
struct ControlHandlers {
  // An order, in the socket's own thread and at once; nothing: the line is none.
  std::function<std::optional<std::string>(const std::string& line)> order;
  // All else, one line after the other, in a second thread.
  std::function<std::string(const std::string& line)> change;
};

class ControlSocket {
 public:
  // Makes the folder where it isn't there. Throws SetupError: a folder that others may enter, a path that is taken.
  ControlSocket(const std::filesystem::path& path, ControlHandlers handlers);
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;
  ~ControlSocket();  // and the socket's file is gone

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Before a bus is opened: throws SetupError where ControlSocket would.
void require_control_path(const std::filesystem::path& path);

// What an answer begins with where the session does as it is asked.
inline constexpr std::string_view agreed = "ok: ";

// Sends a line and returns the answer. Throws SetupError where nobody listens.
std::string ask_control_socket(const std::filesystem::path& path, const std::string& line);

// Where `proxarm set` looks when it isn't told: proxarm/control in the user's runtime folder, or in /tmp/proxarm-UID.
std::filesystem::path default_control_path();

}  // namespace proxarm::command_line
