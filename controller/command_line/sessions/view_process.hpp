// Starts the process that shows the session, the view's process, and tells it what to show and how the session ended.
//
// The view's process runs another program (controller/extras/view/program/live_view.hpp), so the session has none of
// the view's code in memory. Of the session's memory, the view's process has only the black box, and only reads it. If
// the view crashes, the session goes on unchanged.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "controller/command_line/entry/browser.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/stability/passed_poses.hpp"

namespace proxarm::command_line {

class ViewProcess {
 public:
  enum class Shows : std::uint8_t {
    session,
    simulated_arm,  // without a proxy, and without a scene unless --scene names one
  };

  // Starts the view's process and prints the view's URL on standard error. `memory` is the descriptor of the black
  // box's memory. Precondition: no other thread runs yet. Throws SetupError if the session can't be shown.
  ViewProcess(const controller::PreparedSession& session, const controller::RunOptions& options, int memory,
              Shows shows = Shows::session);
  ViewProcess(const ViewProcess&) = delete;
  ViewProcess& operator=(const ViewProcess&) = delete;
  ~ViewProcess();  // ends the view

  [[nodiscard]] const controller::ViewPlace& place() const noexcept { return place_; }

  // Tells the viewers that the session is over. Returns when a signal comes or the view's process ends; until then the
  // view stays.
  void show_end(int exit_status);

 private:
  void start(int memory);
  void greet(const controller::PreparedSession& session, const controller::RunOptions& options, Shows shows);

  std::string url_;
  controller::ViewPlace place_;
  std::optional<BrowserDoor> door_;
  int line_ = -1;
  int child_ = -1;
};

// Sends the viewers the margin to instability at the place that was judged last. Doesn't block.
void tell_margin(const controller::ViewPlace& place, const controller::PassedPoses::Place& judged);

// Returns the path of the control socket that --view-control uses if --control isn't given. The path differs for each
// session.
std::filesystem::path view_control_path();
// Removes the files that are left of the socket at view_control_path().
void remove_view_control();

}  // namespace proxarm::command_line
