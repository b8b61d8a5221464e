// The session's side of the view: starts the process that shows it, tells it what there is to see, and how it ended.
//
// That process (command_line/view/live_view.hpp) is another program, so nothing of it is in this one's memory. It maps
// the black box's memory for reading, which the cycle writes anyway: the cycle does nothing for it. Whether it lives or
// dies changes nothing here.
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
    simulated_arm,  // alone: it knows no proxy, and no scene but the one that --scene names
  };

  // `memory`: descriptor of the black box. Starts the process and prints the URL on standard error. No other thread may
  // run yet. Throws SetupError where it can't be shown.
  ViewProcess(const PreparedSession& session, const RunOptions& options, int memory, Shows shows = Shows::session);
  ViewProcess(const ViewProcess&) = delete;
  ViewProcess& operator=(const ViewProcess&) = delete;
  ~ViewProcess();  // and what it shows is gone

  [[nodiscard]] const ViewPlace& place() const noexcept { return place_; }

  // The session is over: tells whoever looks, and lets them look until a signal comes or the process is gone.
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

// How far from swinging the session is from now on, for whoever looks. Waits for nobody.
void tell_margin(const ViewPlace& place, const controller::PassedPoses::Place& judged);

// The socket that --view-control has where there is no --control: of this session alone.
std::filesystem::path view_control_path();
// And what is left of it afterwards.
void remove_view_control();

}  // namespace proxarm::command_line
