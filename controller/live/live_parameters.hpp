// Changes the parameters of a running session by text, such as "mass=3", "damping=20Ns/m" or "spring=0". A change of an
// object names the object: "wall.friction=0.5", "plate.position_m=0.1,0,0".
//
// Each change goes through the checks of the session's start, with all earlier changes made. A refused change has no
// effect.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controller/cycle/cycle.hpp"
#include "controller/live/control_socket.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"
#include "controller/rendering/change.hpp"

namespace proxarm::controller {

class LiveParameters {
 public:
  // The options' `force_unstable` also allows changes to unstable values.
  LiveParameters(const PreparedSession& session, const RunOptions& options);

  // Makes a change other than of the timestep, and returns it for the session. Throws SetupError if the change is
  // refused.
  Change take(const std::string& text);
  // Throws SetupError if this object's tool differs from the tool of `before`, and the sensor's readings contradict the
  // new tool.
  void require_tool(const LiveParameters& before, const ToolEvidence& seen) const;
  // Returns whether the text is a change of the timestep, such as "timestep=2ms".
  [[nodiscard]] static bool is_timestep(const std::string& text);
  // Checks a change of the timestep by all checks of the session's start that depend on T, and returns the new
  // timestep. Throws SetupError.
  Timestep take_timestep(const std::string& text);
  // Takes over the session's actual timestep, which differs from the one asked for if a drive refused it.
  void follow(double period_s);
  // Counts one more timestep that was passed on to the session.
  void count_timestep() noexcept { ++asked_timesteps_; }
  [[nodiscard]] std::uint32_t asked_timesteps() const noexcept { return asked_timesteps_; }

 private:
  Change take_lookahead(const std::string& text);
  Change take_tool(const std::string& text);
  [[nodiscard]] RunOptions named(double period_s) const;

  PreparedSession session_;
  RunOptions options_;
  std::uint32_t asked_timesteps_ = 0;
};

// Throws SetupError that names `key` if the session takes neither changes nor orders.
void require_changeable(const PreparedSession& session, const std::string& key);

// Checks the options --set, --do and --control before a bus is opened. Throws SetupError.
void require_changes(const PreparedSession& session, const RunOptions& options);

// A change of the script (--set) that had no effect.
struct IdleChange {
  std::string text;     // the change as the user wrote it, without its time
  double time_s = 0.0;  // when the change was due, in time of rendering
  const char* refusal;  // why it had no effect
};
// Returns the changes of the script that had no effect. `texts` are the options' changes, with their times. Call this
// function after the session.
std::vector<IdleChange> idle_changes(const Cycle& cycle, const std::vector<std::string>& texts);

// Schedules the changes and orders of the session's script. Call it before the first cycle; throws SetupError.
void schedule_changes(Cycle& cycle, const PreparedSession& session, const RunOptions& options);

// Returns handlers of orders and changes to the running session, for any thread. They read the session's status from
// `box`. Precondition: all arguments outlive the handlers.
ControlHandlers control_handlers(Cycle& cycle, const PreparedSession& session, const RunOptions& options,
                                 const BoxReader& box);

// Opens the control socket if the options ask for one; otherwise returns null.
std::unique_ptr<ControlSocket> control_socket(const RunOptions& options, ControlHandlers handlers);

}  // namespace proxarm::controller
