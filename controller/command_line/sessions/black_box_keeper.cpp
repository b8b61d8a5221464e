#include "controller/command_line/sessions/black_box_keeper.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "controller/command_line/live/signal_watch.hpp"
#include "controller/command_line/preparation/effective_config.hpp"
#include "controller/command_line/sessions/session_output.hpp"
#include "controller/library/session_summary.hpp"
#include "controller/signals/derived_signals.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

namespace {

namespace fs = std::filesystem;
using controller::BoxCycle;
using controller::BoxFrame;

constexpr const char* default_folder = "proxarm-black-box";

// Returns for how many frames per cycle the box has room: a TPDO and a setpoint per axis, and eight for SYNC,
// heartbeats and the sensor's poll and frames. The sum is doubled for other traffic on the buses.
std::size_t frames_per_cycle(const description::Cell& cell) { return 2 * (2 * cell.drives.size() + 8); }

fs::path folder_for(const RunOptions& options) {
  if (!options.black_box_dir.empty()) return options.black_box_dir;
  return options.record_dir.empty() ? fs::path(default_folder) : options.record_dir / "black-box";
}

// Returns the shortest timestep for which the box has room. If the timestep may change, that is at most 1 ms.
double shortest_period_s(const PreparedSession& session, const RunOptions& options) {
  const double period_s = session.settings.period_s;
  const bool may_change = !options.control.empty() || !options.changes.empty();
  return may_change ? std::min(period_s, 1e-3) : period_s;
}

template <std::size_t N>
void put(std::array<char, N>& text, const std::string& value) {
  if (value.size() >= N)
    throw description::SetupError({.found = description::in_quotes(value), .expected = "a shorter path"});
  std::copy(value.begin(), value.end(), text.begin());
}

}  // namespace

controller::ReplayHead replay_head(const PreparedSession& session, const std::vector<std::string>& bus_names,
                                   const controller::BusIndices& indices) {
  controller::ReplayHead head;
  head.settings = session.settings;
  head.axes = static_cast<std::uint32_t>(session.cell.drives.size());
  if (bus_names.size() > controller::max_buses || indices.size() > controller::max_buses) {
    throw description::SetupError({.file = session.cell.file.string(),
                                   .key = "buses",
                                   .found = std::to_string(indices.size()),
                                   .expected = "at most " + std::to_string(controller::max_buses)});
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

struct BlackBoxKeeper::Shared {
  controller::ReplayHead head;
  std::array<char, 2048> reason{};
  std::atomic<bool> written{false};  // set by the keeper when everything is on the disk
};

namespace {
[[noreturn]] void refuse_start(const char* what) {
  throw description::SetupError({.message = std::string(what) + " of the black box: " + std::strerror(errno),
                                 .advice = "see ulimit -a: open files, processes, memory"});
}
}  // namespace

BlackBoxKeeper::BlackBoxKeeper(const PreparedSession& session, const RunOptions& options)
    : session_(session),
      folder_(fs::absolute(folder_for(options))),
      box_(shortest_period_s(session, options), frames_per_cycle(session.cell),
           options.view ? controller::BlackBox::Memory::by_descriptor : controller::BlackBox::Memory::forked) {
  if (!options.black_box_dir.empty()) controller::SessionWriter(folder_, {}, false);
  void* const memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) refuse_start("the memory");
  shared_ = new (memory) Shared;
  start();
}

void BlackBoxKeeper::start() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) refuse_start("the pipe to the keeper");
  std::fflush(nullptr);
  child_ = fork();
  if (child_ == 0) {
    close(ends[1]);
    keep(ends[0]);
  }
  close(ends[0]);
  say_ = ends[1];
  if (child_ < 0) std::fprintf(stderr, "proxarm: no black box: %s\n", std::strerror(errno));
}

BlackBoxKeeper::~BlackBoxKeeper() {
  close(say_);
  if (child_ > 0) waitpid(child_, nullptr, 0);
  munmap(shared_, sizeof(Shared));
}

void BlackBoxKeeper::set_head(const controller::ReplayHead& head) noexcept { shared_->head = head; }
const controller::ReplayHead& BlackBoxKeeper::head() const noexcept { return shared_->head; }

bool BlackBoxKeeper::finish(const std::string& reason) {
  reason.copy(shared_->reason.data(), shared_->reason.size() - 1);
  const char word = reason.empty() ? 'f' : 'w';
  while (::write(say_, &word, 1) < 0 && errno == EINTR) {
  }
  if (child_ > 0) waitpid(child_, nullptr, 0);
  child_ = -1;
  return shared_->written.load();
}

// Waits for the session's end, and writes the box if necessary. Runs in the keeper's process.
void BlackBoxKeeper::keep(int said) {
  prctl(PR_SET_NAME, "proxarm-box");
  ignore_ending_signals();
  char word = 0;
  ssize_t got = 0;
  do {
    got = read(said, &word, 1);
  } while (got < 0 && errno == EINTR);
  const bool died = got <= 0;
  if (!died && word == 'f') _exit(0);
  try {
    // If the session ended before its first cycle, there is nothing to write, and the session has reported the reason
    // itself.
    if (box_.cycles() > 0) {
      write(died ? "The session ended without a word: the program crashed or was killed." : shared_->reason.data());
      if (died) std::fprintf(stderr, "proxarm: the session died; its black box is in %s\n", folder_.c_str());
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "proxarm: no black box could be written: %s\n", error.what());
  }
  _exit(0);
}

void BlackBoxKeeper::write(const std::string& reason) const {
  controller::SessionWriter files(folder_, controller::joint_names(session_.cell), false);
  files.write_file("reason.txt", reason + "\n");
  files.write_file("effective.yaml", effective_config(session_));
  controller::ReplayRecorder replay(box_, folder_, replay_files(session_));
  replay.drain(shared_->head);
  replay.finish();
  controller::SummaryBuilder figures(controller::summary_config(session_));
  const controller::SignalDeriver deriver(session_.cell);
  BoxCycle cycle;
  std::vector<BoxFrame> frames;
  const auto add_frames = [&] {
    for (const BoxFrame& frame : frames) {
      files.add_frame(shared_->head.bus_names[frame.bus].data(), frame.frame, frame.time_ns);
    }
  };
  for (std::uint64_t k = box_.oldest_cycle(); k < box_.cycles(); ++k) {
    if (!box_.read(k, cycle, frames)) continue;
    controller::complete(cycle.record, session_, cycle.rendered_ns);
    figures.add(cycle.record);
    files.add(cycle.record, deriver.derive(cycle.record));
    add_frames();
  }
  frames = box_.unfinished();
  add_frames();
  files.finish(figures.finish());
  shared_->written.store(true);
}

}  // namespace proxarm::command_line
