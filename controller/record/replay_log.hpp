// The files for a replay, in the folder "replay" of a recorded session or a black box:
//
//   cycles.bin   the controller's state at one cycle; from there on, each cycle's input and the resulting setpoints.
//                Entries, each after its length in bytes (u32): head, state, cycles; little-endian, without padding.
//                Cycles are in blocks, each after its packed and unpacked length (both u32). Only the version of
//                proxarm that wrote the file reads it
//   files/       copies of the cell, scene, arm, sensor, meshes and register maps, at the same places relative to
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
  std::uint32_t buses = 0;                                  // of the network
  std::array<std::uint8_t, max_buses> bus_of_cell_bus{};    // index in the network
  std::array<std::array<char, 32>, max_buses> bus_names{};  // of the network's buses, ended by 0
  std::array<char, 512> cell{}, scene{}, tool{};            // files, ended by 0; in a file relative to files/. Empty
                                                            // tool: a point; the scene's own tool: the scene's file
  std::uint64_t first_cycle = 0;
};
static_assert(std::is_trivially_copyable_v<ReplayHead>);

// Copies these files into `folder`, at the same places relative to each other. Returns the common part of their paths,
// which is left out there. Throws SetupError.
std::filesystem::path copy_files(const std::vector<std::filesystem::path>& files, const std::filesystem::path& folder);

// The position of an entry in cycles.bin: its block in the file, and its offset in the block.
struct ReplayPlace {
  std::int64_t block = 0;
  std::size_t at = 0;
};

// Writes cycles.bin; finish() reports a failed write. A session that dies loses at most its last block, 1/3 s on the
// default cell.
class ReplayWriter {
 public:
  ReplayWriter(const std::filesystem::path& file, ReplayHead head, std::vector<std::byte> state);
  void add(BoxCycle& cycle, std::vector<BoxFrame>& frames);
  void finish();  // throws SetupError

 private:
  void put(const fieldbus::StateArchive& entry);
  void end_block();

  std::filesystem::path name_;
  std::ofstream file_;
  std::string block_;  // entries not written yet
  std::uint32_t axes_, buses_;
  std::vector<std::byte> entry_;
};

// Moves whole cycles from a black box to `folder`/replay: a session from its first cycle, or the rest of one. Not for
// the cycle's thread.
class ReplayRecorder {
 public:
  // Copies the files. Throws SetupError.
  ReplayRecorder(const BlackBox& box, const std::filesystem::path& folder,
                 const std::vector<std::filesystem::path>& files);
  void drain(const ReplayHead& head);
  void finish();  // throws SetupError; if the writer fell behind by more than the box holds, the replay ends there

 private:
  const BlackBox& box_;
  std::filesystem::path folder_, common_;
  std::unique_ptr<ReplayWriter> writer_;
  std::uint64_t next_ = 0;
  bool lost_ = false;
};

// The path of a file of the record (ReplayHead::cell, scene); refuses paths that lead outside. Throws SetupError.
std::filesystem::path recorded_file(const std::filesystem::path& folder, const char* name);
// The path of ReplayHead::tool; empty for a point.
std::filesystem::path recorded_tool(const std::filesystem::path& folder, const ReplayHead& head);

// Reads cycles.bin. Throws SetupError for a file of another kind or of another version.
class ReplayReader {
 public:
  explicit ReplayReader(const std::filesystem::path& file);
  [[nodiscard]] const ReplayHead& head() const noexcept { return head_; }
  [[nodiscard]] const std::vector<std::byte>& state() const noexcept { return state_; }
  // Returns false at the end. The record holds only the cycle's number and setpoints. An incomplete last entry, as
  // after a crash, counts as the end.
  bool next(BoxCycle& cycle, std::vector<BoxFrame>& frames);
  // The position of the entry that next() reads; go_to() returns there.
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
  std::string block_;              // the present one
  std::int64_t block_begins_ = 0;  // in the file
  std::int64_t block_ends_ = 0;
  std::size_t at_ = 0;  // in the block, of the next entry
  ReplayHead head_;
  std::vector<std::byte> state_, entry_;
};

// A network that gives each cycle its recorded frames, in order, and the recorded results of its sends.
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
