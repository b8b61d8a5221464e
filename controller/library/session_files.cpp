#include "controller/library/session_files.hpp"

#include <unistd.h>

#include "controller/library/session_summary.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/effective_config.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::controller {

namespace fs = std::filesystem;

// Throws before the run if the plot's file can't be written. Its name must end in .svg, so that --plot overwrites no
// file but a picture.
void require_plot_file(const fs::path& file) {
  if (file.empty()) return;
  const auto refuse = [&](const char* expected) {
    throw description::SetupError(
        {.key = "--plot", .found = description::in_quotes(file.string()), .expected = expected});
  };
  if (file.extension() != ".svg") refuse("a file name that ends in .svg");
  const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) refuse("a file in a folder that is there");
  if (access(folder.c_str(), W_OK) != 0 || fs::is_directory(file, ignored)) refuse("a file that can be written");
}

SessionFiles::SessionFiles(const PreparedSession& session, const RunOptions& options, const BlackBox& box,
                           Replay replay)
    : session_(session),
      options_(options),
      box_(box),
      kept_replay_(replay),
      head_(replay_head(session, bus_names(session.cell), buses_in_order(session.cell))),
      deriver_(session.cell) {
  if (!options.black_box_dir.empty()) SessionWriter(options.black_box_dir, {}, false);
  const bool draws = !options.plot_file.empty() || !options.record_dir.empty();
  if (options.plot && draws) plot_ = std::make_unique<PlotBuilder>(plot_title(session));
  if (options.record_dir.empty()) return;
  writer_ = std::make_unique<SessionWriter>(options.record_dir, joint_names(session.cell), true, options.signals);
  writer_->write_file("effective.yaml", effective_config(session));
  if (replay == Replay::kept)
    replay_ = std::make_unique<ReplayRecorder>(box, options.record_dir, replay_files(session));
  messages_ = std::make_unique<RecordedMessages>(options.record_dir, session);
}

void SessionFiles::add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  if (writer_) writer_->add_frame(bus, frame, time_ns);
}

void SessionFiles::add(const CycleRecord& completed) {
  if (writer_) writer_->add(completed, deriver_.derive(completed));
  if (plot_) plot_->add(completed);
  if (messages_) {
    messages_->add(completed);
    messages_->drain(box_);
  }
  if (replay_) replay_->drain(head_);
}

void SessionFiles::finish(Summary& summary) {
  if (replay_) replay_->finish();
  if (messages_) messages_->finish();
  write_box(summary);
  draw(summary);
  if (writer_) writer_->finish(summary);
}

void SessionFiles::write_box(Summary& summary) const {
  const fs::path folder = black_box_folder(options_);
  if (folder.empty() || !summary.ended_by_fault() || box_.cycles() == 0) return;
  write_black_box(folder, box_, head_, session_, summary.faults.back().text, kept_replay_);
  summary.black_box = fs::absolute(folder).string();
}

// Without gnuplot a record has no plot. A plot that was asked for by --plot throws.
void SessionFiles::draw(const Summary& summary) const {
  if (!plot_ || plot_->is_empty()) return;
  const fs::path file = options_.plot_file.empty() ? options_.record_dir / "plot.svg" : options_.plot_file;
  const std::string warning = plot_->write(file, plot_headline(summary));
  if (!warning.empty() && !options_.plot_file.empty()) throw description::SetupError({.message = warning});
}

}  // namespace proxarm::controller
