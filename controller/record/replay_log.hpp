// What a replay needs, in a folder "replay" of its own inside a recorded session or a black box:
//
//   cycles.bin   the controller's state at one cycle, and from there on, cycle by cycle, what it was given and the
//                setpoints that it made of it. Entries, each after its length in bytes (u32): head, state, cycles;
//                little-endian, without padding. The cycles' are in blocks, each after its length packed and unpacked
//                (u32 both). Read by the version of proxarm that wrote it
//   files/       copies of the cell, scene, arm, sensor, meshes and register maps, at the places that they had beside
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

// The session's settings, apart from the files.
struct ReplayHead {
  SessionSettings settings;
  std::uint32_t axes = 0;
  std::uint32_t buses = 0;                                  // of the network
  std::array<std::uint8_t, max_buses> bus_of_cell_bus{};    // index in the network
  std::array<std::array<char, 32>, max_buses> bus_names{};  // of the network's, ended by 0
  std::array<char, 512> cell{}, scene{}, tool{};            // files, ended by 0; in a file relative to files/. An empty
                                                            // tool is a point; the scene's own has the scene's file
  std::uint64_t first_cycle = 0;
};
static_assert(std::is_trivially_copyable_v<ReplayHead>);

// Copies these files into `folder`, at the same places relative to each other. Returns the part that their paths have
// in common, which is left out there. Throws SetupError.
std::filesystem::path copy_files(const std::vector<std::filesystem::path>& files, const std::filesystem::path& folder);

// Where an entry of cycles.bin begins: its block in the file, and where in there.
struct ReplayPlace {
  std::int64_t block = 0;
  std::size_t at = 0;
};

// Writes cycles.bin; a failed write is reported by finish(). A session that dies loses its last block at most, which is
// a third of a second of the default cell's.
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
  std::string block_;  // entries that aren't written yet
  std::uint32_t axes_, buses_;
  std::vector<std::byte> entry_;
};

// Takes whole cycles out of a black box as they come, and writes them to `folder`/replay: a session from its first
// cycle, or all that is left of one. Not for the cycle's thread.
class ReplayRecorder {
 public:
  // Copies the files. Throws SetupError.
  ReplayRecorder(const BlackBox& box, const std::filesystem::path& folder,
                 const std::vector<std::filesystem::path>& files);
  void drain(const ReplayHead& head);
  void finish();  // throws SetupError; the replay ends where the writer fell behind by more than the box holds

 private:
  const BlackBox& box_;
  std::filesystem::path folder_, common_;
  std::unique_ptr<ReplayWriter> writer_;
  std::uint64_t next_ = 0;
  bool lost_ = false;
};

// A file of the record (ReplayHead::cell, scene), and nowhere else. Throws SetupError.
std::filesystem::path recorded_file(const std::filesystem::path& folder, const char* name);
// That of ReplayHead::tool; empty where a point was rendered.
std::filesystem::path recorded_tool(const std::filesystem::path& folder, const ReplayHead& head);

// Reads cycles.bin. Throws SetupError for a file of another kind or of another version.
class ReplayReader {
 public:
  explicit ReplayReader(const std::filesystem::path& file);
  [[nodiscard]] const ReplayHead& head() const noexcept { return head_; }
  [[nodiscard]] const std::vector<std::byte>& state() const noexcept { return state_; }
  // False at the end. The record holds the cycle's number and setpoints only. A last entry that isn't whole counts as
  // the end, since a crash may cut it off.
  bool next(BoxCycle& cycle, std::vector<BoxFrame>& frames);
  // Where the entry begins that next() reads; and to go back there.
  [[nodiscard]] ReplayPlace position() const noexcept;
  void go_to(const ReplayPlace& place);
  // Passes over an entry. False at the end.
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
  std::size_t at_ = 0;  // in the block, of the entry that comes next
  ReplayHead head_;
  std::vector<std::byte> state_, entry_;
};

// A network that gives each cycle the frames that it was given, in their order, and the results of its sends.
class ReplayNetwork final : public fieldbus::CanNetwork {
 public:
  explicit ReplayNetwork(const ReplayHead& head);
  ~ReplayNetwork() override;

  // Sets what the next cycle will receive.
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
