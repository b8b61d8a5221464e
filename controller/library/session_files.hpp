// Writes the files of a session in your own program, as `proxarm run` does: record, plot, and the black box after a
// fault; each only if its option is given.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "controller/library/black_box_files.hpp"
#include "controller/library/recorded_messages.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"
#include "controller/record/replay_log.hpp"
#include "controller/report/plot.hpp"
#include "controller/report/session_record.hpp"
#include "controller/report/summary.hpp"
#include "controller/signals/derived_signals.hpp"

namespace proxarm::controller {

// Throws SetupError if no plot can be written to `file`, which --plot names. Empty: no plot is named.
void require_plot_file(const std::filesystem::path& file);

class SessionFiles {
 public:
  // Makes the record's folder; throws SetupError. A session with its own world, sensor or drives has no replay, which
  // is computed from files alone. Precondition: session, options and box outlive this object.
  SessionFiles(const PreparedSession& session, const RunOptions& options, const BlackBox& box, Replay replay);

  [[nodiscard]] const SignalDeriver& deriver() const noexcept { return deriver_; }
  [[nodiscard]] bool keeps_frames() const noexcept { return writer_ != nullptr; }
  void add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns);
  // Takes the completed record of the cycle that has just ended.
  void add(const CycleRecord& completed);
  // Writes all files and sets summary.black_box. Throws SetupError.
  void finish(Summary& summary);

 private:
  void write_box(Summary& summary) const;
  void draw(const Summary& summary) const;

  const PreparedSession& session_;
  const RunOptions& options_;
  const BlackBox& box_;
  Replay kept_replay_;
  ReplayHead head_;
  SignalDeriver deriver_;
  std::unique_ptr<SessionWriter> writer_;
  std::unique_ptr<ReplayRecorder> replay_;
  std::unique_ptr<RecordedMessages> messages_;
  std::unique_ptr<PlotBuilder> plot_;
};

}  // namespace proxarm::controller
