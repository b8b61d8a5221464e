// Makes a session's summary, plot and recorded files. It gets the records of all cycles in order, outside the cycle's
// thread.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "controller/command_line/sessions/black_box_keeper.hpp"
#include "controller/cycle/cycle.hpp"
#include "controller/library/led_poses.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/report/plot.hpp"
#include "controller/report/progress.hpp"
#include "controller/report/session_record.hpp"
#include "controller/report/summary.hpp"
#include "controller/session/session.hpp"
#include "controller/signals/derived_signals.hpp"

namespace proxarm::command_line {

class SessionOutput {
 public:
  // Makes the folder for recorded files if the options ask for one. `with_truth`: the records of cycles hold the
  // simulation's truth. Throws SetupError.
  SessionOutput(const controller::PreparedSession& session, const controller::RunOptions& options, bool with_truth);

  // Prints what the user should know before the arm moves. Call this function after signals are watched, as the user
  // may then want to stop the session.
  void introduce() const;
  // Completes a cycle's record with the quantities for which the scene is needed (distances, friction), and takes it
  // into summary, plot and files. Returns the completed record.
  controller::CycleRecord add(const controller::CycleRecord& record);
  void add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns);

  // Returns the summary of all records and of the cycle's results. Before finish(), the caller adds what only the
  // caller knows. `cause` explains SessionEnd::asked.
  [[nodiscard]] controller::Summary summary(const controller::Cycle& cycle, controller::SessionEnd end,
                                            const controller::EndingCause& cause);
  // Writes the files, draws the plot, and prints the summary on standard output. After a fault, makes the keeper write
  // the black box. Returns the exit status.
  int finish(controller::Summary summary, BlackBoxKeeper& keeper);

 private:
  bool draw_plot(const controller::Summary& summary);
  void say_timestep(const controller::CycleRecord& record);
  void say_oscillation();
  void say_belief(const controller::CycleRecord& record);
  void tell(const controller::CycleRecord& record);
  void judge_pose(const controller::CycleRecord& record);
  void say_lateness(const controller::CycleRecord& record) const;
  void say_poses();
  void say_how_to_get_free(controller::Phase phase) const;

  const controller::PreparedSession& session_;
  const controller::RunOptions& options_;
  controller::SummaryBuilder builder_;
  controller::Progress progress_;
  std::unique_ptr<controller::PlotBuilder> plot_;
  std::unique_ptr<controller::SessionWriter> writer_;
  controller::SignalDeriver deriver_;
  std::unique_ptr<controller::LedPoses> poses_;  // null for the impedance type
  std::optional<controller::Swing> swing_;       // of a tool that the hand turns
  std::chrono::steady_clock::duration spent_{};  // time spent on records
  std::int64_t rendered_ns_ = 0;
  std::int64_t told_period_ns_ = 0;  // the timestep that was last reported to the user
  bool told_oscillation_ = false;    // whether the present spell was reported
  // Whether nobody held the handle in the previous cycle, and whether that was reported.
  bool was_off_ = false, told_belief_ = false;
  controller::Phase last_phase_ = controller::Phase::idle;
};

}  // namespace proxarm::command_line
