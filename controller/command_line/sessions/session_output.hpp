// Makes a session's summary, plot and record. It gets every record in order, outside the cycle.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "controller/command_line/live/signal_watch.hpp"
#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/sessions/black_box_keeper.hpp"
#include "controller/cycle/cycle.hpp"
#include "controller/library/led_poses.hpp"
#include "controller/report/plot.hpp"
#include "controller/report/progress.hpp"
#include "controller/report/session_record.hpp"
#include "controller/report/summary.hpp"
#include "controller/session/session.hpp"
#include "controller/signals/derived_signals.hpp"

namespace proxarm::command_line {

class SessionOutput {
 public:
  // Makes the record's folder if wanted; throws SetupError. `with_truth`: records hold the simulation's truth.
  SessionOutput(const PreparedSession& session, const RunOptions& options, bool with_truth);

  // Prints what the user should know before the arm moves. Call it once signals are watched, as the user may want to
  // stop.
  void introduce() const;
  // Completes the record with what only the scene gives (distances, friction), and processes it. Returns the completed
  // record.
  controller::CycleRecord add(const controller::CycleRecord& record);
  void add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns);

  // Summarises all records and the cycle's results; the caller adds what only it knows before finish(). `cause`
  // explains SessionEnd::asked.
  [[nodiscard]] controller::Summary summary(const controller::Cycle& cycle, controller::SessionEnd end,
                                            const EndingCause& cause);
  // Writes files, draws the plot, prints the summary on standard output, and after a fault has the black box written.
  // Returns the exit status.
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

  const PreparedSession& session_;
  const RunOptions& options_;
  controller::SummaryBuilder builder_;
  controller::Progress progress_;
  std::unique_ptr<controller::PlotBuilder> plot_;
  std::unique_ptr<controller::SessionWriter> writer_;
  controller::SignalDeriver deriver_;
  std::unique_ptr<controller::LedPoses> poses_;  // admittance type
  std::optional<controller::Swing> swing_;       // of a tool that is turned
  std::chrono::steady_clock::duration spent_{};  // on records and figures
  std::int64_t rendered_ns_ = 0;
  std::int64_t told_period_ns_ = 0;             // the timestep last reported to the user
  bool told_oscillation_ = false;               // reported for the present spell
  bool was_off_ = false, told_belief_ = false;  // nobody held the handle in the previous cycle; that was reported
  controller::Phase last_phase_ = controller::Phase::idle;
};

}  // namespace proxarm::command_line
