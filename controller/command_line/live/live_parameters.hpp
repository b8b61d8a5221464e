// The parameters of a session that may change while it runs, as text: "mass=3", "damping=20Ns/m", "spring=0"; of an
// object by its name "wall.friction=0.5", "plate.position_m=0.1,0,0".
//
// Each change is judged as it would be at the start, with what has been changed before; what is refused changes
// nothing.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controller/command_line/live/control_socket.hpp"
#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/cycle/cycle.hpp"
#include "controller/record/black_box.hpp"
#include "controller/rendering/change.hpp"

namespace proxarm::command_line {

class LiveParameters {
 public:
  // `force_unstable` as in RunOptions. `session` must outlive it.
  LiveParameters(const PreparedSession& session, const RunOptions& options);

  // Throws SetupError.
  controller::Change take(const std::string& text);
  // Throws SetupError where the session's sensor denies the tool that has changed since `before`.
  void require_tool(const LiveParameters& before, const controller::ToolEvidence& seen) const;
  // "timestep=2ms".
  [[nodiscard]] static bool is_timestep(const std::string& text);
  // Judged by what the start judges it by, as far as it depends on T. Throws SetupError.
  controller::Timestep take_timestep(const std::string& text);
  // What the session's timestep really is: drives may have refused the last one.
  void follow(double period_s);
  // Of those that were handed on.
  void count_timestep() noexcept { ++asked_timesteps_; }
  [[nodiscard]] std::uint32_t asked_timesteps() const noexcept { return asked_timesteps_; }

 private:
  controller::Change take_lookahead(const std::string& text);
  controller::Change take_tool(const std::string& text);
  [[nodiscard]] RunOptions named(double period_s) const;

  PreparedSession session_;
  RunOptions options_;
  std::uint32_t asked_timesteps_ = 0;
};

// Throws SetupError that names `key` where nothing of the session can be changed or ordered.
void require_changeable(const PreparedSession& session, const std::string& key);

// Of the script and the socket, before a bus is opened. Throws SetupError.
void require_changes(const PreparedSession& session, const RunOptions& options);

// A change of the script that did nothing.
struct IdleChange {
  std::string text;     // as it was given, without its time
  double time_s = 0.0;  // of rendering
  const char* refusal;  // why
};
// Of a session that has ended; `texts` are those of its options.
std::vector<IdleChange> idle_changes(const controller::Cycle& cycle, const std::vector<std::string>& texts);

// The session's script. Before the first cycle; throws SetupError.
void schedule_changes(controller::Cycle& cycle, const PreparedSession& session, const RunOptions& options);

// What orders and changes do to the session while it runs, from any threads. What is asked of it is read in `box`. All
// must outlive the handlers.
ControlHandlers control_handlers(controller::Cycle& cycle, const PreparedSession& session, const RunOptions& options,
                                 const controller::BoxReader& box);

// The session's socket, where one is wanted; null without.
std::unique_ptr<ControlSocket> control_socket(const RunOptions& options, ControlHandlers handlers);

}  // namespace proxarm::command_line
