// The session's side of the view: starts the process that shows the session, and tells it what to show and how the
// session ended.
//
// That process (command_line/view/live_view.hpp) is another program, so the session has none of its code in memory. It
// only reads the black box's memory. If it crashes, the session goes on unchanged.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "controller/command_line/live/browser.hpp"
#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/stability/passed_poses.hpp"

namespace proxarm::command_line {

class ViewProcess {
 public:
  enum class Shows : std::uint8_t {
    session,
    simulated_arm,  // no proxy, and no scene unless --scene names one
  };

  // Starts the process and prints the URL on standard error. `memory` is the black box's descriptor. Precondition: no
  // other thread runs yet. Throws SetupError if the session can't be shown.
  ViewProcess(const PreparedSession& session, const RunOptions& options, int memory, Shows shows = Shows::session);
  ViewProcess(const ViewProcess&) = delete;
  ViewProcess& operator=(const ViewProcess&) = delete;
  ~ViewProcess();  // ends the view

  [[nodiscard]] const ViewPlace& place() const noexcept { return place_; }

  // Tells the viewers that the session is over. The view stays until a signal comes or its process ends.
  void show_end(int exit_status);

 private:
  void start(int memory);
  void greet(const PreparedSession& session, const RunOptions& options, Shows shows);

  std::string url_;
  ViewPlace place_;
  std::optional<BrowserDoor> door_;
  int line_ = -1;
  int child_ = -1;
};

// Sends the viewers the present margin to instability. Doesn't block.
void tell_margin(const ViewPlace& place, const controller::PassedPoses::Place& judged);

// The socket of --view-control without --control, for this session only.
std::filesystem::path view_control_path();
// Removes what is left of that socket.
void remove_view_control();

}  // namespace proxarm::command_line
