#include "controller/record/replay_log.hpp"

#include <algorithm>
#include <cstring>
#include <optional>

#include "models/base/setup_error.hpp"
#include "models/packed/packed.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;
using description::SetupError;

// Upper bound for the number of frames in a cycle, far above a real number: a period of 100 ms on eight buses at 1
// Mbit/s.
constexpr std::uint32_t most_frames_per_cycle = 16384;
constexpr std::size_t most_entry_bytes = most_frames_per_cycle * 96 + 4096;
constexpr std::size_t block_bytes = 1 << 18;
constexpr std::size_t most_block_bytes = block_bytes + most_entry_bytes + sizeof(std::uint32_t);
constexpr std::array<char, 16> magic{'p', 'r', 'o', 'x', 'a', 'r', 'm', ' ', 'r', 'e', 'p', 'l', 'a', 'y', '1', '3'};

[[noreturn]] void cannot_write(const fs::path& file, const std::string& found) {
  throw SetupError({.file = file.string(), .found = found, .expected = "a file that can be written"});
}

void archive(fieldbus::StateArchive& state, SessionSettings& s) noexcept {
  static_assert(sizeof(SessionSettings) == 240, "a new setting belongs into this list");
  state(s.scheme, s.coupling_stiffness_N_per_m, s.coupling_damping_Ns_per_m, s.period_s, s.receive_window, s.mass_kg,
        s.damping_Ns_per_m, s.spring_N_per_m, s.order, s.looks_ahead, s.horizon_s, s.gear_damping_per_s, s.damped_gears,
        s.orientation, s.passivity, s.force_age_s, s.report_rate_Hz, s.rotational_inertia_kg_m2,
        s.rotational_damping_Nms_per_rad, s.rotational_spring_Nm_per_rad, s.tare_s, s.tare_spread_N, s.zero_S_N,
        s.zero_drift_N, s.only_tares, s.always_held, s.enable_timeout_s, s.enabling_timeout_s, s.wait_after_fault_s,
        s.without_enabling_input, s.max_missed_samples, s.max_repeated_samples, s.max_missed_feedback, s.max_overruns);
}

void archive(fieldbus::StateArchive& state, ReplayHead& head) noexcept {
  archive(state, head.settings);
  state(head.axes, head.buses, head.bus_of_cell_bus, head.bus_names, head.cell, head.scene, head.tool,
        head.first_cycle);
}

// Reads or writes a frame. Returns false if the frame's bus or length is out of range.
bool archive(fieldbus::StateArchive& state, BoxFrame& frame, std::uint32_t buses) noexcept {
  fieldbus::CanFrame& f = frame.frame;
  state(frame.time_ns, frame.bus, frame.sent, frame.result, f.id, f.extended, f.remote, f.error, f.fd,
        f.bit_rate_switch, f.length);
  if (frame.bus >= buses || f.length > f.data.size()) return false;
  state.raw(std::as_writable_bytes(std::span(f.data).first(f.length)));
  return true;
}

bool archive(fieldbus::StateArchive& state, BoxCycle& cycle, std::vector<BoxFrame>& frames, std::uint32_t axes,
             std::uint32_t buses) {
  std::uint32_t count = static_cast<std::uint32_t>(frames.size());
  state(cycle.record.cycle, cycle.t_k_ns, cycle.overruns_in_a_row, cycle.stop_requested, cycle.change.parameter,
        cycle.change.value, cycle.change.object, cycle.change.position_m, cycle.change.period_s, cycle.change.horizon_s,
        cycle.change.tool_mass_kg, cycle.command.order, cycle.command.value, cycle.timestep.period_s,
        cycle.timestep.max_missed_samples, cycle.timestep.max_repeated_samples, cycle.timestep.horizon_s,
        cycle.input_bytes, count);
  if (cycle.input_bytes > cycle.inputs.size() || count > most_frames_per_cycle) return false;
  state.raw(std::span(cycle.inputs).first(cycle.input_bytes));
  for (std::uint32_t bus = 0; bus < buses; ++bus) state(cycle.buses[bus].state, cycle.buses[bus].receive_overflows);
  for (std::uint32_t axis = 0; axis < axes; ++axis) state(cycle.record.target_counts[axis]);
  frames.resize(count);
  return std::all_of(frames.begin(), frames.end(), [&](BoxFrame& frame) { return archive(state, frame, buses); });
}

template <std::size_t N>
bool is_ended(const std::array<char, N>& text) {
  return std::find(text.begin(), text.end(), '\0') != text.end();
}

}  // namespace

fs::path copy_files(const std::vector<fs::path>& files, const fs::path& folder) {
  fs::path common = files.front().parent_path();
  for (const fs::path& file : files) {
    const auto [end, ignored] = std::mismatch(common.begin(), common.end(), file.begin(), file.end());
    fs::path shared;
    for (auto part = common.begin(); part != end; ++part) shared /= *part;
    common = shared;
  }
  for (const fs::path& file : files) {
    const fs::path to = folder / file.lexically_relative(common);
    std::error_code error;
    fs::create_directories(to.parent_path(), error);
    if (!error) fs::copy_file(file, to, fs::copy_options::overwrite_existing, error);
    if (error) cannot_write(to, error.message());
  }
  return common;
}

fs::path recorded_file(const fs::path& folder, const char* name) {
  const fs::path relative(name);
  const bool leaves = relative.is_absolute() || relative.empty() ||
                      std::find(relative.begin(), relative.end(), fs::path("..")) != relative.end();
  if (!leaves) return folder / replay_folder / "files" / relative;
  throw SetupError(
      {.file = folder.string(), .found = description::in_quotes(name), .expected = "a file of the record"});
}

fs::path recorded_tool(const fs::path& folder, const ReplayHead& head) {
  return head.tool[0] == '\0' ? fs::path() : recorded_file(folder, head.tool.data());
}

// ---- writing

ReplayWriter::ReplayWriter(const fs::path& file, ReplayHead head, std::vector<std::byte> state)
    : name_(file),
      file_(file, std::ios::binary | std::ios::trunc),
      axes_(head.axes),
      buses_(head.buses),
      entry_(most_entry_bytes) {
  if (!file_) cannot_write(name_, "a file that can't be opened");
  file_.write(magic.data(), magic.size());
  auto entry = fieldbus::StateArchive::writer(entry_);
  archive(entry, head);
  put(entry);
  entry = fieldbus::StateArchive::writer(entry_);
  entry.raw(state);
  put(entry);
  file_.write(block_.data(), static_cast<std::streamsize>(block_.size()));
  block_.clear();
}

void ReplayWriter::put(const fieldbus::StateArchive& entry) {
  const auto bytes = static_cast<std::uint32_t>(entry.bytes());
  block_.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
  block_.append(reinterpret_cast<const char*>(entry_.data()), bytes);
}

void ReplayWriter::end_block() {
  if (block_.empty()) return;
  const std::string packed = models::packed(block_);
  const std::array sizes{static_cast<std::uint32_t>(packed.size()), static_cast<std::uint32_t>(block_.size())};
  file_.write(reinterpret_cast<const char*>(sizes.data()), sizeof sizes);
  file_.write(packed.data(), static_cast<std::streamsize>(packed.size()));
  block_.clear();
}

void ReplayWriter::add(BoxCycle& cycle, std::vector<BoxFrame>& frames) {
  auto entry = fieldbus::StateArchive::writer(entry_);
  archive(entry, cycle, frames, axes_, buses_);
  put(entry);
  if (block_.size() >= block_bytes) end_block();
}

void ReplayWriter::finish() {
  end_block();
  file_.close();
  if (!file_) cannot_write(name_, "a file that couldn't be written whole");
}

ReplayRecorder::ReplayRecorder(const BlackBox& box, const fs::path& folder, const std::vector<fs::path>& files)
    : box_(box), folder_(folder / replay_folder) {
  common_ = copy_files(files, folder_ / "files");
}

void ReplayRecorder::drain(const ReplayHead& head) {
  if (!writer_) {
    std::vector<std::byte> state;
    if (!box_.oldest_state(next_, state)) return;
    ReplayHead written = head;
    written.first_cycle = next_;
    for (auto* name : {&written.cell, &written.scene, &written.tool}) {
      if ((*name)[0] == '\0') continue;
      const std::string relative = fs::path(name->data()).lexically_relative(common_).string();
      if (relative.size() >= name->size()) cannot_write(folder_, "a path that is too long");
      name->fill('\0');
      std::copy(relative.begin(), relative.end(), name->begin());
    }
    writer_ = std::make_unique<ReplayWriter>(folder_ / "cycles.bin", written, state);
  }
  BoxCycle cycle;
  std::vector<BoxFrame> frames;
  for (; next_ < box_.cycles() && !lost_; ++next_) {
    lost_ = !box_.read(next_, cycle, frames);
    if (!lost_) writer_->add(cycle, frames);
  }
}

void ReplayRecorder::finish() {
  if (writer_) writer_->finish();
}

// ---- reading

void ReplayReader::refuse(const std::string& found) const {
  throw SetupError({.file = name_.string(),
                    .found = found,
                    .expected = "what this version of proxarm writes",
                    .advice = "give the folder of a session (--record) or of a black box"});
}

// Returns false if the entry is incomplete.
bool ReplayReader::read_entry() {
  std::uint32_t bytes = 0;
  file_.read(reinterpret_cast<char*>(&bytes), sizeof bytes);
  if (static_cast<std::size_t>(file_.gcount()) != sizeof bytes) return false;
  if (bytes > most_entry_bytes) refuse("an entry of " + std::to_string(bytes) + " bytes");
  entry_.resize(bytes);
  file_.read(reinterpret_cast<char*>(entry_.data()), static_cast<std::streamsize>(bytes));
  return static_cast<std::size_t>(file_.gcount()) == bytes;
}

ReplayReader::ReplayReader(const fs::path& file) : name_(file) {
  std::error_code error;
  const fs::file_type type = fs::status(file, error).type();
  if (fs::exists(fs::file_status(type)) && type != fs::file_type::regular) refuse("no regular file");
  file_.open(file, std::ios::binary);
  if (!file_) refuse("no such file");
  std::array<char, magic.size()> first{};
  file_.read(first.data(), first.size());
  if (file_ && first != magic) refuse("another kind of file, or of another version");
  if (!file_ || !read_entry()) refuse("a file that is too short");
  auto entry = fieldbus::StateArchive::reader(entry_);
  archive(entry, head_);
  if (!entry.whole() || entry.bytes() != entry_.size()) refuse("the head of another version");
  const auto ended = [](const auto& text) { return is_ended(text); };
  // A cell without CAN buses has none; the unused entries are 0.
  const auto known = [this](std::uint8_t bus) { return bus < std::max<std::uint32_t>(head_.buses, 1); };
  if (head_.axes > max_axes || head_.buses > max_buses || !is_ended(head_.cell) || !is_ended(head_.scene) ||
      !is_ended(head_.tool) || !std::all_of(head_.bus_names.begin(), head_.bus_names.end(), ended) ||
      !std::all_of(head_.bus_of_cell_bus.begin(), head_.bus_of_cell_bus.end(), known)) {
    refuse("a head that is damaged");
  }
  if (!read_entry()) refuse("a file that is too short");
  state_ = entry_;
  block_begins_ = block_ends_ = file_.tellg();
}

// Returns false at the end of the file or before an incomplete block.
bool ReplayReader::read_block() {
  block_begins_ = block_ends_;
  at_ = 0;
  block_.clear();
  file_.clear();
  file_.seekg(block_begins_);
  std::array<std::uint32_t, 2> sizes{};
  file_.read(reinterpret_cast<char*>(sizes.data()), sizeof sizes);
  if (static_cast<std::size_t>(file_.gcount()) != sizeof sizes) return false;
  const auto [packed_bytes, bytes] = sizes;
  if (bytes > most_block_bytes || packed_bytes > most_block_bytes) {
    refuse("a block of " + std::to_string(std::max(bytes, packed_bytes)) + " bytes");
  }
  std::string packed(packed_bytes, '\0');
  file_.read(packed.data(), packed_bytes);
  if (static_cast<std::size_t>(file_.gcount()) != packed_bytes) return false;
  std::optional<std::string> block = models::unpacked(packed, bytes);
  if (!block || block->empty()) refuse("a block that is damaged");
  block_ = *std::move(block);
  block_ends_ = block_begins_ + static_cast<std::int64_t>(sizeof sizes + packed_bytes);
  return true;
}

bool ReplayReader::read_cycle() {
  if (at_ == block_.size() && !read_block()) return false;
  std::uint32_t bytes = 0;
  const std::size_t left = block_.size() - at_;
  if (left >= sizeof bytes) std::memcpy(&bytes, block_.data() + at_, sizeof bytes);
  if (left < sizeof bytes || bytes > left - sizeof bytes) refuse("an entry that is damaged");
  const auto* const begin = reinterpret_cast<const std::byte*>(block_.data() + at_ + sizeof bytes);
  entry_.assign(begin, begin + bytes);
  at_ += sizeof bytes + bytes;
  return true;
}

bool ReplayReader::next(BoxCycle& cycle, std::vector<BoxFrame>& frames) {
  if (!read_cycle()) return false;
  auto entry = fieldbus::StateArchive::reader(entry_);
  const bool sound = archive(entry, cycle, frames, head_.axes, head_.buses);
  if (!sound || !entry.whole() || entry.bytes() != entry_.size()) refuse("an entry that is damaged");
  return true;
}

ReplayPlace ReplayReader::position() const noexcept {
  if (at_ < block_.size()) return {block_begins_, at_};
  return {block_ends_, 0};
}

void ReplayReader::go_to(const ReplayPlace& place) {
  if (place.block != block_begins_ || block_.empty()) {
    block_ends_ = place.block;
    if (!read_block()) return;
  }
  at_ = std::min(place.at, block_.size());
}

bool ReplayReader::skip() { return read_cycle(); }

// ---- the network

class ReplayNetwork::Bus final : public fieldbus::CanBus {
 public:
  Bus(ReplayNetwork& network, std::uint8_t index, std::string name)
      : network_(network), index_(index), name_(std::move(name)) {}

  fieldbus::SendResult send(const fieldbus::CanFrame&) noexcept override {
    return next_ < results_.size() ? results_[next_++] : fieldbus::SendResult::sent;
  }
  // Returns the network's next frame if it came on this bus. This keeps the order of frames among the buses.
  bool receive(fieldbus::TimedFrame& out) noexcept override {
    if (network_.next_ >= network_.received_.size()) return false;
    const BoxFrame& frame = network_.received_[network_.next_];
    if (frame.bus != index_) return false;
    out = {frame.frame, frame.time_ns};
    ++network_.next_;
    return true;
  }
  [[nodiscard]] const fieldbus::BusStatus& status() const noexcept override { return status_; }
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }

  void load(const BusInput& input, const std::vector<BoxFrame>& frames) {
    status_.state = input.state;
    status_.receive_overflows = input.receive_overflows;
    results_.clear();
    next_ = 0;
    for (const BoxFrame& frame : frames) {
      if (frame.sent && frame.bus == index_) results_.push_back(frame.result);
    }
  }

 private:
  ReplayNetwork& network_;
  std::uint8_t index_;
  std::string name_;
  fieldbus::BusStatus status_;
  std::vector<fieldbus::SendResult> results_;
  std::size_t next_ = 0;
};

ReplayNetwork::ReplayNetwork(const ReplayHead& head) {
  for (std::uint8_t bus = 0; bus < head.buses; ++bus) {
    buses_.push_back(std::make_unique<Bus>(*this, bus, head.bus_names[bus].data()));
  }
}
ReplayNetwork::~ReplayNetwork() = default;

void ReplayNetwork::load(const BoxCycle& cycle, const std::vector<BoxFrame>& frames) {
  now_ns_ = cycle.t_k_ns;
  for (std::size_t bus = 0; bus < buses_.size(); ++bus) buses_[bus]->load(cycle.buses[bus], frames);
  received_.clear();
  next_ = 0;
  std::copy_if(frames.begin(), frames.end(), std::back_inserter(received_), [](const BoxFrame& f) { return !f.sent; });
}

std::size_t ReplayNetwork::bus_count() const noexcept { return buses_.size(); }
fieldbus::CanBus& ReplayNetwork::bus(std::size_t index) noexcept { return *buses_[index]; }

bool ReplayNetwork::wait_for_frame(std::int64_t deadline_ns) noexcept {
  if (next_ < received_.size()) return true;
  now_ns_ = deadline_ns;
  return false;
}

}  // namespace proxarm::controller
