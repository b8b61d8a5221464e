// A session's ear: a Unix socket that takes a line "NAME=VALUE" and answers with one, for its owner alone.
//
// The socket has mode 0600 in a folder of mode 0700, and who connects is asked of the kernel (SO_PEERCRED): another
// user is turned away even where a file system knows no modes. It is no network port. Lines are at most 256 bytes.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace proxarm::command_line {

class ControlSocket {
 public:
  // Makes the folder where it isn't there. Throws SetupError: a folder that others may enter, a path that is taken.
  // `handle` runs in the socket's own thread, gives the answer, and may throw SetupError, whose text is the answer
  // then.
  ControlSocket(const std::filesystem::path& path, std::function<std::string(const std::string& line)> handle);
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;
  ~ControlSocket();  // and the socket's file is gone

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Before a bus is opened: throws SetupError where ControlSocket would.
void require_control_path(const std::filesystem::path& path);

// Sends a line and returns the answer. Throws SetupError where nobody listens.
std::string ask_control_socket(const std::filesystem::path& path, const std::string& line);

// Where `proxarm set` looks when it isn't told: proxarm/control in the user's runtime folder, or in /tmp/proxarm-UID.
std::filesystem::path default_control_path();

}  // namespace proxarm::command_line
