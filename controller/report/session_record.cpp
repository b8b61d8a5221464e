#include "controller/report/session_record.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "fieldbus/can/candump_log.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t buffer_bytes = 1 << 16;
// All files that a session's folder may hold, which a later session replaces.
constexpr const char* file_names[] = {"signals.csv", "frames.log",  "effective.yaml", "effective.json", "summary.json",
                                      "timing.json", "plot.svg",    "plot.png",       "cell.yaml",      "scene.yaml",
                                      "hand.yaml",   "sensor.yaml", "arm.urdf",       "reason.txt"};

bool is_ours(std::string_view name) {
  return std::find(std::begin(file_names), std::end(file_names), name) != std::end(file_names);
}

// A session's replay, or its black box: folders with nothing else in them, and no links to such.
bool is_our_folder(const fs::path& path) {
  std::error_code error;
  if (fs::symlink_status(path, error).type() != fs::file_type::directory) return false;
  const bool replay = path.filename() == "replay";
  if (!replay && path.filename() != "black-box") return false;
  return std::all_of(fs::directory_iterator(path, error), {}, [&](const fs::directory_entry& entry) {
    const fs::path name = entry.path().filename();
    return replay ? name == "cycles.bin" || name == "files" : is_ours(name.string()) || is_our_folder(entry.path());
  });
}

template <typename Number>
void append_number(std::string& text, Number value) {
  std::array<char, 32> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end);
}

void append_triple(std::string& row, const Triple& values) {
  for (const double value : values) {
    row += ',';
    append_number(row, value);
  }
}

// Nanoseconds as seconds, digit by digit: 1250000 is 0.00125.
void append_seconds(std::string& text, std::int64_t ns, std::size_t least_decimals) {
  if (ns < 0) text += '-';
  const std::uint64_t size = ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  append_number(text, size / 1'000'000'000);
  std::string decimals = std::to_string(1'000'000'000 + size % 1'000'000'000).substr(1);
  while (decimals.size() > least_decimals && decimals.back() == '0') decimals.pop_back();
  if (!decimals.empty()) text += "." + decimals;
}

struct FlagName {
  RecordFlag flag;
  const char* name;
};
// `overrun` is left out because it is of the wall clock, `truth` because the columns say it.
constexpr FlagName flag_names[] = {{RecordFlag::sample_held, "sample_held"},
                                   {RecordFlag::feedback_missing, "feedback_missing"},
                                   {RecordFlag::limit_speed, "limit_speed"},
                                   {RecordFlag::limit_acceleration, "limit_acceleration"},
                                   {RecordFlag::limit_workspace, "limit_workspace"},
                                   {RecordFlag::limit_joint, "limit_joint"},
                                   {RecordFlag::limit_power, "limit_power"},
                                   {RecordFlag::limit_keep_out, "limit_keep_out"},
                                   {RecordFlag::limit_joint_speed, "limit_joint_speed"},
                                   {RecordFlag::limit_joint_acceleration, "limit_joint_acceleration"},
                                   {RecordFlag::limit_singularity, "limit_singularity"},
                                   {RecordFlag::limit_following_error, "limit_following_error"},
                                   {RecordFlag::limit_joint_torque, "limit_joint_torque"},
                                   {RecordFlag::guard_speed, "guard_speed"},
                                   {RecordFlag::guard_elbow, "guard_elbow"},
                                   {RecordFlag::guard_border, "guard_border"},
                                   {RecordFlag::guard_acceleration, "guard_acceleration"},
                                   {RecordFlag::limit_leash, "limit_leash"},
                                   {RecordFlag::limit_orientation, "limit_orientation"},
                                   {RecordFlag::oscillation, "oscillation"},
                                   {RecordFlag::oscillation_lasts, "oscillation_lasts"},
                                   {RecordFlag::timestep, "timestep"},
                                   {RecordFlag::ramp_in, "ramp_in"},
                                   {RecordFlag::slowed, "slowed"},
                                   {RecordFlag::hands_off, "hands_off"}};

void append_flags(std::string& row, const CycleRecord& record) {
  bool first = true;
  for (const FlagName& flag : flag_names) {
    if (!record.has(flag.flag)) continue;
    if (!first) row += '|';
    row += flag.name;
    first = false;
  }
}

}  // namespace

std::string signals_header(const std::vector<std::string>& axis_names, bool with_truth) {
  std::string header = "cycle,time_s,phase,contact,flags";
  const auto triple_columns = [&header](const char* name, const char* unit) {
    for (const char* axis : {"_x_", "_y_", "_z_"}) header += std::string(",") + name + axis + unit;
  };
  triple_columns("force_S", "N");
  triple_columns("torque_S", "Nm");
  triple_columns("force_W", "N");
  triple_columns("torque_W", "Nm");
  triple_columns("p_hat_W", "m");
  triple_columns("proxy_W", "m");
  triple_columns("contact_force_W", "N");
  triple_columns("normal_W", "1");
  header += ",contacts,contact_object,friction_1";
  triple_columns("tool_W", "m");
  header += ",proxy_clearance_m,tool_clearance_m";
  for (const char* what : {"_target_counts", "_actual_counts"}) {
    for (const std::string& name : axis_names) header += "," + name + what;
  }
  if (with_truth) {
    triple_columns("true_tool_W", "m");
    triple_columns("hand_force_W", "N");
  }
  return header;
}

void append_signals(std::string& row, const CycleRecord& r, std::size_t axes, bool with_truth) {
  append_number(row, r.cycle);
  row += ',';
  append_seconds(row, r.time_ns, 0);
  row += ',';
  row += phase_name(r.phase);
  row += ',';
  row += contact_phase_name(r.contact);
  row += ',';
  append_flags(row, r);
  for (const Triple* values : {&r.force_S_N, &r.torque_S_Nm, &r.force_W_N, &r.torque_W_Nm, &r.p_hat_W_m, &r.proxy_W_m,
                               &r.contact_force_W_N, &r.normal_W}) {
    append_triple(row, *values);
  }
  row += ',';
  append_number(row, static_cast<int>(r.contact_count));
  row += ',';
  append_number(row, r.contact_object);
  row += ',';
  append_number(row, r.friction);
  append_triple(row, r.tool_W_m);
  for (const double value : {r.proxy_clearance_m, r.tool_clearance_m}) {
    row += ',';
    append_number(row, value);
  }
  for (const auto* counts : {&r.target_counts, &r.actual_counts}) {
    for (std::size_t axis = 0; axis < axes; ++axis) {
      row += ',';
      append_number(row, (*counts)[axis]);
    }
  }
  if (!with_truth) return;
  if (r.has(RecordFlag::truth)) {
    append_triple(row, r.true_tool_W_m);
    append_triple(row, r.hand_force_W_N);
  } else {
    row += ",,,,,,";
  }
}

// On a file system without locks, nobody is kept out.
bool SessionWriter::Lock::take(const fs::path& folder) noexcept {
  descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  return descriptor_ < 0 || flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

SessionWriter::Lock::~Lock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

SessionWriter::SessionWriter(const fs::path& folder, const std::vector<std::string>& axis_names, bool with_truth)
    : folder_(folder), axes_(std::min(axis_names.size(), max_axes)), with_truth_(with_truth) {
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
  for (const char* name : {"replay", "black-box"}) fs::remove_all(folder_ / name, error);
  open(signals_, "signals.csv");
  open(frames_, "frames.log");
  signals_.buffer =
      signals_header({axis_names.begin(), axis_names.begin() + static_cast<std::ptrdiff_t>(axes_)}, with_truth_) + "\n";
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

void SessionWriter::add(const CycleRecord& record) {
  append_signals(signals_.buffer, record, axes_, with_truth_);
  signals_.buffer += '\n';
  if (signals_.buffer.size() >= buffer_bytes) flush(signals_);
}

void SessionWriter::add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  fieldbus::CandumpLine line;
  frames_.buffer.append(line.data(), fieldbus::format_candump_line(line, time_ns, bus, frame));
  if (frames_.buffer.size() >= buffer_bytes) flush(frames_);
}

void SessionWriter::write_file(std::string_view name, std::string_view text) {
  if (!is_ours(name)) throw std::logic_error("a session doesn't hold a file named " + std::string(name));
  File file;
  open(file, std::string(name).c_str());
  file.buffer = text;
  close(file);
}

void SessionWriter::finish(const Summary& summary) {
  close(signals_);
  close(frames_);
  write_file("summary.json", repeatable_json(summary));
  write_file("timing.json", timing_json(summary));
}

}  // namespace proxarm::controller
