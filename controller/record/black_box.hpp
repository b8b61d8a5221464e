// Keeps the last ten seconds in memory: what came into the cycle, what left it, and the controller's state.
//
// The cycle writes here (noexcept, no lock, no allocation, no system call; every page is touched beforehand). The
// memory is a shared mapping, so that a process that was forked off before still has it when this one has died
// (command_line/black_box_keeper.hpp), and a process that is given its descriptor can read it (MappedBox). Four rings,
// overwritten from their oldest end:
//   cycles   one entry per cycle: what came in by other ways than frames, and the cycle's record
//   frames   all that was received and sent, in order
//   truths   of a simulation: where the tool truly is, which the cycle doesn't know; written beside it, for who watches
//   states   the controller's whole state at the begin of a cycle, once a second: where a replay can start
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "controller/rendering/change.hpp"
#include "controller/supervision/command.hpp"
#include "fieldbus/can/can_network.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

inline constexpr std::size_t max_buses = 8;

struct BoxFrame {
  fieldbus::CanFrame frame;
  std::int64_t time_ns = 0;  // received: when it was on the wire; sent: when it was handed to the interface
  std::uint8_t bus = 0;
  bool sent = false;
  fieldbus::SendResult result = fieldbus::SendResult::sent;
};

struct BusInput {
  fieldbus::BusState state = fieldbus::BusState::error_active;
  std::uint64_t receive_overflows = 0;
};

// What one cycle was given, and its record.
struct BoxCycle {
  std::int64_t t_k_ns = 0;
  std::uint64_t first_frame = 0;  // in the ring of frames, counted from the first cycle
  std::uint32_t frames = 0;
  std::uint32_t overruns_in_a_row = 0;
  bool stop_requested = false;
  Change change;
  Command command;
  Timestep timestep;
  std::array<BusInput, max_buses> buses{};
  std::uint16_t input_bytes = 0;
  std::array<std::byte, 512> inputs{};  // CyclicDrive::archive_input() of all drives
  std::int64_t rendered_ns = 0;
  CycleRecord record;
};

// A simulated tool at a cycle's begin, in W.
struct BoxTruth {
  std::uint64_t cycle = 0;  // counted from the first one
  Triple tool_m{};
  std::array<double, 4> tool_q{0.0, 0.0, 0.0, 1.0};  // x y z w
};

static_assert(std::is_trivially_copyable_v<BoxCycle> && std::is_trivially_copyable_v<BoxFrame> &&
              std::is_trivially_copyable_v<BoxTruth>);

// The cycle's side of it.
class CycleBox {
 public:
  CycleBox() = default;
  CycleBox(const CycleBox&) = delete;
  CycleBox& operator=(const CycleBox&) = delete;
  virtual ~CycleBox() = default;

  // The entry of the cycle that begins; all of it is for the caller to fill.
  [[nodiscard]] virtual BoxCycle& begin(std::int64_t t_k_ns) noexcept = 0;
  virtual void add(const BoxFrame& frame) noexcept = 0;
  virtual void finish() noexcept = 0;
  // Room for a state where one is due, before the first frame of the cycle; empty: none is.
  [[nodiscard]] virtual std::span<std::byte> state_room() noexcept = 0;
  virtual void finish_state(std::size_t bytes) noexcept = 0;
};

// What any thread or process may read of a box while its cycle writes: whole cycles only.
class BoxReader {
 public:
  static constexpr std::size_t most_state_bytes = 16384;

  BoxReader(const BoxReader&) = delete;
  BoxReader& operator=(const BoxReader&) = delete;

  [[nodiscard]] std::uint64_t cycles() const noexcept { return head_->cycles.load(std::memory_order_acquire); }
  // False where the cycle has been overwritten, which also happens while a reader in another thread copies it.
  bool read(std::uint64_t cycle, BoxCycle& out, std::vector<BoxFrame>& frames) const;
  // The same without its frames.
  bool read(std::uint64_t cycle, BoxCycle& out) const noexcept;
  [[nodiscard]] std::uint64_t oldest_cycle() const noexcept;
  // Up to which cycle the truth is told; 0: nobody tells it.
  [[nodiscard]] std::uint64_t truths() const noexcept { return head_->truths.load(std::memory_order_acquire); }
  // False where it isn't there (any more).
  bool truth(std::uint64_t cycle, BoxTruth& out) const noexcept;
  // The oldest state from which all cycles are still there. False where there is none.
  bool oldest_state(std::uint64_t& cycle, std::vector<std::byte>& state) const;
  // The frames of a cycle that was begun and never ended.
  [[nodiscard]] std::vector<BoxFrame> unfinished() const;

 protected:
  struct State {
    std::uint64_t cycle = 0;
    std::size_t size = 0;
    std::array<std::byte, most_state_bytes> bytes{};
  };
  static constexpr std::size_t state_count = 16;
  struct Head {
    std::uint64_t layout = 0;  // of the program that wrote it: layout_of_this_program()
    std::uint64_t cycle_capacity = 0, frame_capacity = 0;
    std::atomic<std::uint64_t> cycles{0}, frames{0}, states{0}, truths{0};
  };
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
  // Another build may have other records.
  [[nodiscard]] static std::uint64_t layout_of_this_program() noexcept {
    return sizeof(BoxCycle) << 32U | sizeof(BoxFrame);
  }

  BoxReader() = default;
  ~BoxReader() = default;
  [[nodiscard]] static std::size_t bytes_for(std::size_t cycles, std::size_t frames) noexcept {
    return sizeof(Head) + cycles * (sizeof(BoxCycle) + sizeof(BoxTruth)) + frames * sizeof(BoxFrame) +
           state_count * sizeof(State);
  }
  // The rings within the memory that begins with `head`, which has the capacities.
  void lay_out(Head* head) noexcept;

  Head* head_ = nullptr;
  BoxCycle* cycles_ = nullptr;
  BoxTruth* truths_ = nullptr;
  BoxFrame* frames_ = nullptr;
  State* states_ = nullptr;
};

class BlackBox final : public CycleBox, public BoxReader {
 public:
  static constexpr double seconds = 10.0;

  enum class Memory : std::uint8_t {
    forked,         // for processes that are forked off
    by_descriptor,  // for any process that is given descriptor(), too; counts against a limit of file sizes
  };

  // `frames_per_cycle`: the largest number that is expected.
  BlackBox(double period_s, std::size_t frames_per_cycle, Memory memory = Memory::forked);
  ~BlackBox() override;

  [[nodiscard]] BoxCycle& begin(std::int64_t t_k_ns) noexcept override;
  void add(const BoxFrame& frame) noexcept override;
  void finish() noexcept override;
  [[nodiscard]] std::span<std::byte> state_room() noexcept override;
  void finish_state(std::size_t bytes) noexcept override;
  // Of the newest cycle, by whoever simulates it, after the cycle.
  void add_truth(const Triple& tool_m, const std::array<double, 4>& tool_q) noexcept;

  // Memory::by_descriptor: closed on exec, and with the box; else −1.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

 private:
  std::uint64_t cycles_per_state_;
  std::size_t bytes_;
  int descriptor_ = -1;
};

// Another process's box, through its descriptor; the pages are mapped for reading alone.
class MappedBox final : public BoxReader {
 public:
  // Throws std::runtime_error for memory that isn't a box of this build of the program.
  explicit MappedBox(int descriptor);
  ~MappedBox();

 private:
  void* memory_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace proxarm::controller
