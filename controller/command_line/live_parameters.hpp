// The parameters of a session that may change while it runs, as text: "mass=3", "damping=20Ns/m", "spring=0"; of an
// object by its name "wall.friction=0.5", "plate.position_m=0.1,0,0".
//
// Each change is judged as it would be at the start, with what has been changed before; what is refused changes
// nothing.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controller/change.hpp"
#include "controller/command_line/control_socket.hpp"
#include "controller/command_line/prepared_session.hpp"
#include "controller/cycle.hpp"

namespace proxarm::command_line {

class LiveParameters {
 public:
  // `force_unstable` as in RunOptions. `session` must outlive it.
  LiveParameters(const PreparedSession& session, const RunOptions& options);

  // Throws SetupError.
  controller::Change take(const std::string& text);

 private:
  PreparedSession session_;
  RunOptions options_;
};

// Of the script and the socket, before a bus is opened. Throws SetupError.
void require_changes(const PreparedSession& session, const RunOptions& options);

// The session's script, and its socket where one is wanted; null without.
std::unique_ptr<ControlSocket> take_changes(controller::Cycle& cycle, const PreparedSession& session,
                                            const RunOptions& options);

}  // namespace proxarm::command_line
