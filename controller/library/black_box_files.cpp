#include "controller/library/black_box_files.hpp"

#include <algorithm>
#include <array>

#include "controller/library/session_summary.hpp"
#include "controller/preparation/effective_config.hpp"
#include "controller/report/session_record.hpp"
#include "controller/signals/derived_signals.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::controller {

namespace fs = std::filesystem;

namespace {

// Returns for how many frames per cycle the box has room: a TPDO and a setpoint per axis, and eight for SYNC,
// heartbeats and the sensor's poll and frames. The sum is doubled for other traffic on the buses.
std::size_t frames_per_cycle(const description::Cell& cell) { return 2 * (2 * cell.drives.size() + 8); }

template <std::size_t N>
void put(std::array<char, N>& text, const std::string& value) {
  if (value.size() >= N)
    throw description::SetupError({.found = description::in_quotes(value), .expected = "a shorter path"});
  std::copy(value.begin(), value.end(), text.begin());
}

}  // namespace

BoxSize box_size(const PreparedSession& session, bool timestep_may_change) {
  const double period_s = session.settings.period_s;
  return {timestep_may_change ? std::min(period_s, 1e-3) : period_s, frames_per_cycle(session.cell)};
}

fs::path black_box_folder(const RunOptions& options) {
  if (!options.black_box_dir.empty() || options.record_dir.empty()) return options.black_box_dir;
  return options.record_dir / "black-box";
}

ReplayHead replay_head(const PreparedSession& session, const std::vector<std::string>& bus_names,
                       const BusIndices& indices) {
  ReplayHead head;
  head.settings = session.settings;
  head.axes = static_cast<std::uint32_t>(session.cell.drives.size());
  if (bus_names.size() > max_buses || indices.size() > max_buses) {
    throw description::SetupError({.file = session.cell.file.string(),
                                   .key = "buses",
                                   .found = std::to_string(indices.size()),
                                   .expected = "at most " + std::to_string(max_buses)});
  }
  head.buses = static_cast<std::uint32_t>(bus_names.size());
  for (std::size_t i = 0; i < bus_names.size(); ++i) put(head.bus_names[i], bus_names[i]);
  for (std::size_t i = 0; i < indices.size(); ++i) head.bus_of_cell_bus[i] = static_cast<std::uint8_t>(indices[i]);
  put(head.cell, session.cell.file.string());
  put(head.scene, fs::absolute(session.scene.file).lexically_normal().string());
  if (session.scene.tool) put(head.tool, fs::absolute(session.scene.tool->file).lexically_normal().string());
  return head;
}

std::vector<fs::path> replay_files(const PreparedSession& session) {
  std::vector<fs::path> files{session.cell.file, session.cell.urdf, session.scene.file, session.sensor.file,
                              session.hand.file};
  files.insert(files.end(), session.hand.data_files.begin(), session.hand.data_files.end());
  if (session.sensor.described) files.push_back(session.sensor.described->dbc);
  for (const description::DriveDescription& drive : session.cell.drives) {
    files.emplace_back(drive.description);
    files.emplace_back(drive.eds);
  }
  for (const scenes::Object& object : session.scene.objects) {
    if (const auto* mesh = std::get_if<scenes::MeshShape>(&object.shape)) files.push_back(mesh->file);
  }
  if (session.scene.tool) {
    files.push_back(session.scene.tool->file);
    files.insert(files.end(), session.scene.tool->meshes.begin(), session.scene.tool->meshes.end());
  }
  std::erase_if(files, [](const fs::path& file) { return file.empty(); });
  for (fs::path& file : files) file = fs::absolute(file).lexically_normal();
  return files;
}

void write_black_box(const fs::path& folder, const BlackBox& box, const ReplayHead& head,
                     const PreparedSession& session, const std::string& reason, Replay replay) {
  SessionWriter files(folder, joint_names(session.cell), false);
  files.write_file("reason.txt", reason + "\n");
  files.write_file("effective.yaml", effective_config(session));
  if (replay == Replay::kept) {
    ReplayRecorder recorder(box, folder, replay_files(session));
    recorder.drain(head);
    recorder.finish();
  }
  SummaryBuilder figures(summary_config(session));
  const SignalDeriver deriver(session.cell);
  BoxCycle cycle;
  std::vector<BoxFrame> frames;
  const auto add_frames = [&] {
    for (const BoxFrame& frame : frames) {
      files.add_frame(head.bus_names[frame.bus].data(), frame.frame, frame.time_ns);
    }
  };
  for (std::uint64_t k = box.oldest_cycle(); k < box.cycles(); ++k) {
    if (!box.read(k, cycle, frames)) continue;
    complete(cycle.record, session, cycle.rendered_ns);
    figures.add(cycle.record);
    files.add(cycle.record, deriver.derive(cycle.record));
    add_frames();
  }
  frames = box.unfinished();
  add_frames();
  files.finish(figures.finish());
}

}  // namespace proxarm::controller
