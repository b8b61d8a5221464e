// The files for a replay, in the folder "replay" of a recorded session or a black box:
//
//   cycles.bin   the controller's state at one cycle and, from this cycle on, each cycle's input and the setpoints that
//                resulted. The file is a sequence of entries: head, state, cycles. Each entry follows its length in
//                bytes (u32). Entries are little-endian, without padding. The entries of cycles are grouped in blocks;
//                each block follows its packed and its unpacked length (both u32). Only the version of proxarm that
//                wrote the file can read it
//   files/       copies of cell, scene, arm, sensor, meshes and register maps, which keep their places relative to
//                each other
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "controller/record/black_box.hpp"
#include "controller/rendering/session_settings.hpp"

namespace proxarm::controller {

inline constexpr const char* replay_folder = "replay";

// The session's settings, without the files' contents.
struct ReplayHead {
  SessionSettings settings;
  std::uint32_t axes = 0;
  std::uint32_t buses = 0;                                  // number of the network's buses
  std::array<std::uint8_t, max_buses> bus_of_cell_bus{};    // index in the network of each of the cell's buses
  std::array<std::array<char, 32>, max_buses> bus_names{};  // names of the network's buses, each ended by 0
  // Paths of the files, ended by 0; in cycles.bin they are relative to files/. `tool` is empty for a point, and is the
  // scene's path if the scene has the tool.
  std::array<char, 512> cell{}, scene{}, tool{};
  std::uint64_t first_cycle = 0;
};
static_assert(std::is_trivially_copyable_v<ReplayHead>);

// Copies these files into `folder`, and keeps their places relative to each other. Returns the common part of their
// paths, which is left out in `folder`. Throws SetupError.
std::filesystem::path copy_files(const std::vector<std::filesystem::path>& files, const std::filesystem::path& folder);

// The position of an entry in cycles.bin: the position of the entry's block in the file, and the entry's offset in the
// block.
struct ReplayPlace {
  std::int64_t block = 0;
  std::size_t at = 0;
};

// Writes cycles.bin. finish() reports a failed write. If the session dies, at most the last block is lost, 1/3 s on the
// default cell.
class ReplayWriter {
 public:
  ReplayWriter(const std::filesystem::path& file, ReplayHead head, std::vector<std::byte> state);
  void add(BoxCycle& cycle, std::vector<BoxFrame>& frames);
  void finish();  // throws SetupError if the file couldn't be written completely

 private:
  void put(const fieldbus::StateArchive& entry);
  void end_block();

  std::filesystem::path name_;
  std::ofstream file_;
  std::string block_;  // entries that aren't written yet
  std::uint32_t axes_, buses_;
  std::vector<std::byte> entry_;
};

// Writes whole cycles of a black box to `folder`/replay: a session from its first cycle on, or the rest of a session.
// Not for the cycle's thread.
class ReplayRecorder {
 public:
  // Copies the files. Throws SetupError.
  ReplayRecorder(const BlackBox& box, const std::filesystem::path& folder,
                 const std::vector<std::filesystem::path>& files);
  void drain(const ReplayHead& head);
  // Throws SetupError. If the recorder fell behind by more than the box holds, the replay ends where cycles were lost.
  void finish();

 private:
  const BlackBox& box_;
  std::filesystem::path folder_, common_;
  std::unique_ptr<ReplayWriter> writer_;
  std::uint64_t next_ = 0;
  bool lost_ = false;
};

// Returns the path of a recorded file (ReplayHead::cell, scene). Throws SetupError for a path that leads outside
// `folder`.
std::filesystem::path recorded_file(const std::filesystem::path& folder, const char* name);
// Returns the path of ReplayHead::tool; empty for a point.
std::filesystem::path recorded_tool(const std::filesystem::path& folder, const ReplayHead& head);

// Reads cycles.bin. Throws SetupError for a file of another kind or of another version.
class ReplayReader {
 public:
  explicit ReplayReader(const std::filesystem::path& file);
  [[nodiscard]] const ReplayHead& head() const noexcept { return head_; }
  [[nodiscard]] const std::vector<std::byte>& state() const noexcept { return state_; }
  // Reads the next cycle. Of the cycle's record, only number and setpoints are set. Returns false at the end. An
  // incomplete last entry, as after a crash, counts as the end.
  bool next(BoxCycle& cycle, std::vector<BoxFrame>& frames);
  // Returns the position of the entry that next() will read, for go_to().
  [[nodiscard]] ReplayPlace position() const noexcept;
  void go_to(const ReplayPlace& place);
  // Skips an entry. Returns false at the end.
  bool skip();

 private:
  [[noreturn]] void refuse(const std::string& found) const;
  bool read_entry();
  bool read_block();
  bool read_cycle();

  std::filesystem::path name_;
  std::ifstream file_;
  std::string block_;              // the present block, unpacked
  std::int64_t block_begins_ = 0;  // position of the present block in the file
  std::int64_t block_ends_ = 0;
  std::size_t at_ = 0;  // offset of the next entry in the block
  ReplayHead head_;
  std::vector<std::byte> state_, entry_;
};

// A network that delivers each cycle's recorded frames, in order, and the recorded results of sending.
class ReplayNetwork final : public fieldbus::CanNetwork {
 public:
  explicit ReplayNetwork(const ReplayHead& head);
  ~ReplayNetwork() override;

  void load(const BoxCycle& cycle, const std::vector<BoxFrame>& frames);

  [[nodiscard]] std::size_t bus_count() const noexcept override;
  [[nodiscard]] fieldbus::CanBus& bus(std::size_t index) noexcept override;
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ns_; }
  void sleep_until(std::int64_t deadline_ns) noexcept override { now_ns_ = deadline_ns; }
  bool wait_for_frame(std::int64_t deadline_ns) noexcept override;

 private:
  class Bus;
  std::vector<std::unique_ptr<Bus>> buses_;
  std::vector<BoxFrame> received_;
  std::size_t next_ = 0;
  std::int64_t now_ns_ = 0;
};

}  // namespace proxarm::controller
