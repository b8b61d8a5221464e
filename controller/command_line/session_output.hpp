// What a session leaves: summary, plot, record. Fed with every record, in order, outside of the cycle.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "controller/command_line/prepared_session.hpp"
#include "controller/cycle_record.hpp"
#include "controller/session_record.hpp"
#include "controller/summary.hpp"

namespace proxarm::command_line {

class SessionOutput {
 public:
  // Makes the record's folder where one is wanted; throws SetupError. `with_truth`: records carry the simulation's
  // truth.
  SessionOutput(const PreparedSession& session, const RunOptions& options, bool with_truth);

  // Adds the distances to the scene, which the cycle has no need of, and passes the record on.
  void add(controller::CycleRecord record);
  void add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns);

  // Of all that was added; the caller fills in what only it knows before finish().
  [[nodiscard]] controller::Summary summary() { return builder_.finish(); }
  // Writes files, draws the plot, prints the summary to standard output.
  void finish(const controller::Summary& summary);

 private:
  const PreparedSession& session_;
  const RunOptions& options_;
  controller::SummaryBuilder builder_;
  std::unique_ptr<controller::SessionWriter> writer_;
  std::vector<controller::CycleRecord> rendered_;  // for the plot
};

}  // namespace proxarm::command_line
