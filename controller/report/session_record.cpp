#include "controller/report/session_record.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "controller/signals/contact_columns.hpp"
#include "fieldbus/can/candump_log.hpp"
#include "models/base/setup_error.hpp"
#include "models/packed/packed.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t buffer_bytes = 1 << 16;
constexpr std::size_t packed_at_once = 1 << 18;  // bytes of text, 1/3 s of frames; packing shrinks them to a ninth
// All files that a session's folder may hold, and that a later session replaces.
constexpr const char* file_names[] = {"signals.csv",    "signals.bin",    "columns.json",
                                      "frames.log",     "frames.log.zst", "session.mcap",
                                      "contacts.csv",   "contacts.bin",   "contact_columns.json",
                                      "effective.yaml", "effective.json", "summary.json",
                                      "timing.json",    "plot.svg",       "plot.png",
                                      "cell.yaml",      "scene.yaml",     "hand.yaml",
                                      "sensor.yaml",    "arm.urdf",       "reason.txt"};

bool is_ours(std::string_view name) {
  return std::find(std::begin(file_names), std::end(file_names), name) != std::end(file_names);
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type() == fs::file_type::directory;
}

// Returns whether this folder is the Python package's cache of signals.csv (controller/extras/python/proxarm), with a
// file per column.
bool is_kept_columns(const fs::path& path) {
  std::error_code error;
  return is_folder(path) && std::all_of(fs::directory_iterator(path, error), {}, [](const fs::directory_entry& entry) {
           return entry.path().extension() == ".npy" || entry.path().extension() == ".json";
         });
}

// Returns whether this folder is a session's replay, its black box or its cached columns. The folder may contain
// nothing else and may not be a link.
bool is_our_folder(const fs::path& path) {
  std::error_code error;
  if (!is_folder(path)) return false;
  if (path.filename() == "numpy") return std::all_of(fs::directory_iterator(path, error), {}, is_kept_columns);
  const bool replay = path.filename() == "replay";
  if (!replay && path.filename() != "black-box") return false;
  return std::all_of(fs::directory_iterator(path, error), {}, [&](const fs::directory_entry& entry) {
    const fs::path name = entry.path().filename();
    return replay ? name == "cycles.bin" || name == "files" : is_ours(name.string()) || is_our_folder(entry.path());
  });
}

}  // namespace

// On a file system without locks, take() always succeeds.
bool SessionWriter::Lock::take(const fs::path& folder) noexcept {
  descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  return descriptor_ < 0 || flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

SessionWriter::Lock::~Lock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

SessionWriter::SessionWriter(const fs::path& folder, const std::vector<std::string>& axis_names, bool with_truth,
                             SignalsForm form)
    : folder_(folder), axes_(std::min(axis_names.size(), max_axes)), with_truth_(with_truth), form_(form) {
  std::error_code error;
  if (fs::exists(folder_, error) && !fs::is_directory(folder_, error)) {
    fail("", "a file that is no folder");
  }
  fs::create_directories(folder_, error);
  if (error) fail("", error.message());
  if (!lock_.take(folder_)) fail("", "a folder that another session is writing to");
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!is_ours(name) && !is_our_folder(entry->path())) {
      fail("", "a folder that already holds " + description::in_quotes(name));
    }
  }
  if (error) fail("", error.message());
  for (const char* name : file_names) fs::remove(folder_ / name, error);
  for (const char* name : {"replay", "black-box", "numpy"}) fs::remove_all(folder_ / name, error);
  frames_.packed = form == SignalsForm::packed;
  open(frames_, frames_.packed ? "frames.log.zst" : "frames.log");
  const std::vector<std::string> axes{axis_names.begin(), axis_names.begin() + static_cast<std::ptrdiff_t>(axes_)};
  const std::vector<SignalColumn> columns = signal_columns(axes, with_truth_);
  if (form != SignalsForm::csv) {
    open(table_, "signals.bin", columns);
    open(contact_table_, "contacts.bin", contact_columns());
  } else {
    open(signals_, "signals.csv");
    signals_.buffer = header_of(columns) + "\n";
    open(contacts_, "contacts.csv");
    contacts_.buffer = header_of(contact_columns()) + "\n";
  }
  write_file("columns.json", json_of(columns));
  write_file("contact_columns.json", json_of(contact_columns()));
}

void SessionWriter::fail(const std::string& name, const std::string& found) const {
  throw description::SetupError({.file = (name.empty() ? folder_ : folder_ / name).string(),
                                 .key = "--record",
                                 .found = found,
                                 .expected = "a folder to write to, new, empty or of an earlier session"});
}

void SessionWriter::open(File& file, const char* name) {
  file.name = name;
  file.buffer.reserve(buffer_bytes + 4096);
  errno = 0;
  file.stream.open(folder_ / name, std::ios::binary | std::ios::trunc);
  if (!file.stream) fail(name, errno != 0 ? std::strerror(errno) : "a file that can't be opened");
}

void SessionWriter::flush(File& file) {
  if (file.packed) file.buffer = models::packed(file.buffer);
  file.stream.write(file.buffer.data(), static_cast<std::streamsize>(file.buffer.size()));
  file.buffer.clear();
}

void SessionWriter::close(File& file) {
  if (!file.stream.is_open()) return;
  flush(file);
  errno = 0;
  file.stream.close();
  if (!file.stream) fail(file.name, errno != 0 ? std::strerror(errno) : "a file that couldn't be written whole");
}

void SessionWriter::open(std::optional<SignalTableWriter>& table, const char* name,
                         const std::vector<SignalColumn>& columns) {
  const bool packed = form_ == SignalsForm::packed;
  table.emplace(folder_ / name, columns, packed ? SignalTableWriter::Blocks::packed : SignalTableWriter::Blocks::plain);
  if (table->error() != 0) fail(name, std::strerror(table->error()));
}

void SessionWriter::close(std::optional<SignalTableWriter>& table, const char* name) const {
  if (!table) return;
  table->finish();
  if (table->error() != 0) fail(name, std::strerror(table->error()));
}

void SessionWriter::add(const CycleRecord& record, const DerivedSignals& derived) {
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) add_contact(record, i);
  if (table_) {
    store_signals(table_->row(), SignalTableWriter::apart, record, axes_, with_truth_, derived);
    return table_->end_row();
  }
  append_signals(signals_.buffer, record, axes_, with_truth_, derived);
  signals_.buffer += '\n';
  if (signals_.buffer.size() >= buffer_bytes) flush(signals_);
}

void SessionWriter::add_contact(const CycleRecord& record, std::size_t index) {
  if (contact_table_) {
    store_contact(contact_table_->row(), SignalTableWriter::apart, record, index);
    return contact_table_->end_row();
  }
  append_contact(contacts_.buffer, record, index);
  contacts_.buffer += '\n';
  if (contacts_.buffer.size() >= buffer_bytes) flush(contacts_);
}

void SessionWriter::add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  fieldbus::CandumpLine line;
  frames_.buffer.append(line.data(), fieldbus::format_candump_line(line, time_ns, bus, frame));
  if (frames_.buffer.size() >= (frames_.packed ? packed_at_once : buffer_bytes)) flush(frames_);
}

void SessionWriter::write_file(std::string_view name, std::string_view text) {
  if (!is_ours(name)) throw std::logic_error("a session doesn't hold a file named " + std::string(name));
  File file;
  open(file, std::string(name).c_str());
  file.buffer = text;
  close(file);
}

void SessionWriter::finish(const Summary& summary) {
  close(table_, "signals.bin");
  close(contact_table_, "contacts.bin");
  close(signals_);
  close(contacts_);
  close(frames_);
  write_file("summary.json", repeatable_json(summary));
  write_file("timing.json", timing_json(summary));
}

}  // namespace proxarm::controller
