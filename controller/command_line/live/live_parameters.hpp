// Changes the parameters of a running session by text: "mass=3", "damping=20Ns/m", "spring=0"; for an object by its
// name "wall.friction=0.5", "plate.position_m=0.1,0,0".
//
// Each change is checked as at the start, together with earlier changes. A refused change has no effect.
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
  // `force_unstable` as in RunOptions. Precondition: `session` outlives this object.
  LiveParameters(const PreparedSession& session, const RunOptions& options);

  // Throws SetupError.
  controller::Change take(const std::string& text);
  // Throws SetupError if the tool has changed since `before` and the sensor's readings contradict the new one.
  void require_tool(const LiveParameters& before, const controller::ToolEvidence& seen) const;
  // Returns whether the text is like "timestep=2ms".
  [[nodiscard]] static bool is_timestep(const std::string& text);
  // Repeats those checks of the start that depend on T. Throws SetupError.
  controller::Timestep take_timestep(const std::string& text);
  // Takes over the session's actual timestep: drives may have refused the last change.
  void follow(double period_s);
  // Counts the timesteps that were passed on to the session.
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

// Throws SetupError that names `key` if the session takes neither changes nor orders.
void require_changeable(const PreparedSession& session, const std::string& key);

// Checks the changes of the script and the socket before a bus is opened. Throws SetupError.
void require_changes(const PreparedSession& session, const RunOptions& options);

// A change of the script that had no effect.
struct IdleChange {
  std::string text;     // as given, without its time
  double time_s = 0.0;  // rendering time
  const char* refusal;  // why it had no effect
};
// Call it after the session; `texts` are the changes in the options.
std::vector<IdleChange> idle_changes(const controller::Cycle& cycle, const std::vector<std::string>& texts);

// Schedules the session's script. Call it before the first cycle; throws SetupError.
void schedule_changes(controller::Cycle& cycle, const PreparedSession& session, const RunOptions& options);

// Returns handlers of orders and changes to the running session, for any thread. They read the session's status from
// `box`. Precondition: all arguments outlive the handlers.
ControlHandlers control_handlers(controller::Cycle& cycle, const PreparedSession& session, const RunOptions& options,
                                 const controller::BoxReader& box);

// Opens the session's socket if wanted; else returns null.
std::unique_ptr<ControlSocket> control_socket(const RunOptions& options, ControlHandlers handlers);

}  // namespace proxarm::command_line
