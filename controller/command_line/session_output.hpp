// What a session leaves: summary, plot, record. Fed with every record, in order, outside of the cycle.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "controller/command_line/prepared_session.hpp"
#include "controller/cycle_record.hpp"
#include "controller/plot.hpp"
#include "controller/progress.hpp"
#include "controller/session_record.hpp"
#include "controller/summary.hpp"

namespace proxarm::command_line {

class SessionOutput {
 public:
  // Makes the record's folder where one is wanted; throws SetupError. `with_truth`: records carry the simulation's
  // truth.
  SessionOutput(const PreparedSession& session, const RunOptions& options, bool with_truth);

  // Adds the distances to the scene and the friction of what is touched, which the cycle has no need of, and passes the
  // record on. On a terminal it shows how far the run is.
  void add(controller::CycleRecord record);
  void add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns);

  // Of all that was added; the caller fills in what only it knows before finish().
  [[nodiscard]] controller::Summary summary() { return builder_.finish(); }
  // Writes files, draws the plot (a warning on standard error where that isn't possible), prints the summary to
  // standard output.
  void finish(const controller::Summary& summary);

 private:
  void show_progress(const controller::CycleRecord& record);

  const PreparedSession& session_;
  const RunOptions& options_;
  controller::SummaryBuilder builder_;
  std::unique_ptr<controller::SessionWriter> writer_;
  std::optional<controller::PlotBuilder> plot_;
  controller::Progress progress_;
  std::int64_t begun_ns_ = -1;  // of rendering
};

}  // namespace proxarm::command_line
