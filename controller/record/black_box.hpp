// Keeps the last ten seconds of a session in memory: the cycle's input and output, and the controller's state.
//
// The cycle writes here (noexcept, no lock, no allocation, no system call; every page is touched beforehand). The
// memory is a shared mapping. So a process that was forked from this one keeps the memory when this process dies
// (command_line/sessions/black_box_keeper.hpp), and a process that gets the descriptor can read the memory (MappedBox).
// There are four rings, each overwritten from its oldest end:
//   cycles   one entry per cycle: the cycle's input apart from frames, and the cycle's record
//   frames   all received and sent frames, in order
//   truths   in simulation: the tool's true pose, which the cycle doesn't know; written for viewers
//   states   the controller's whole state at the beginning of a cycle, once a second; a replay can start at each state
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
  // Received frame: time on the wire. Sent frame: time when it was handed to the interface.
  std::int64_t time_ns = 0;
  std::uint8_t bus = 0;
  bool sent = false;
  fieldbus::SendResult result = fieldbus::SendResult::sent;
};

struct BusInput {
  fieldbus::BusState state = fieldbus::BusState::error_active;
  std::uint64_t receive_overflows = 0;
};

struct BoxCycle {
  std::int64_t t_k_ns = 0;
  std::uint64_t first_frame = 0;  // in the ring of frames, counted from the session's first frame
  std::uint32_t frames = 0;
  std::uint32_t overruns_in_a_row = 0;
  bool stop_requested = false;
  Change change;
  Command command;
  Timestep timestep;
  std::array<BusInput, max_buses> buses{};
  std::uint16_t input_bytes = 0;
  std::array<std::byte, 512> inputs{};  // archive_input() of all drives, and of a sensor on UDP
  std::int64_t rendered_ns = 0;
  CycleRecord record;
};

// A simulated tool's true pose in W at the beginning of a cycle.
struct BoxTruth {
  std::uint64_t cycle = 0;  // number of the cycle, counted from the first one
  Triple tool_m{};
  std::array<double, 4> tool_q{0.0, 0.0, 0.0, 1.0};  // x y z w
};

static_assert(std::is_trivially_copyable_v<BoxCycle> && std::is_trivially_copyable_v<BoxFrame> &&
              std::is_trivially_copyable_v<BoxTruth>);

// The interface for the cycle.
class CycleBox {
 public:
  CycleBox() = default;
  CycleBox(const CycleBox&) = delete;
  CycleBox& operator=(const CycleBox&) = delete;
  virtual ~CycleBox() = default;

  // Begins an entry. The caller fills every field of the entry.
  [[nodiscard]] virtual BoxCycle& begin(std::int64_t t_k_ns) noexcept = 0;
  virtual void add(const BoxFrame& frame) noexcept = 0;
  virtual void finish() noexcept = 0;
  // Returns memory for a state if a state is due, else an empty span. Precondition: called before the cycle's first
  // frame.
  [[nodiscard]] virtual std::span<std::byte> state_room() noexcept = 0;
  virtual void finish_state(std::size_t bytes) noexcept = 0;
};

// Read access for any thread or process while the cycle writes. Only whole cycles are read.
class BoxReader {
 public:
  static constexpr std::size_t most_state_bytes = 16384;

  BoxReader(const BoxReader&) = delete;
  BoxReader& operator=(const BoxReader&) = delete;

  [[nodiscard]] std::uint64_t cycles() const noexcept { return head_->cycles.load(std::memory_order_acquire); }
  // Reads a cycle with its frames. Returns false if the cycle isn't complete yet, or has been overwritten, even during
  // the copying.
  bool read(std::uint64_t cycle, BoxCycle& out, std::vector<BoxFrame>& frames) const;
  // Reads a cycle without its frames. Returns false as above.
  bool read(std::uint64_t cycle, BoxCycle& out) const noexcept;
  [[nodiscard]] std::uint64_t oldest_cycle() const noexcept;
  // Returns the number of cycles with a true pose; 0: no true pose is written.
  [[nodiscard]] std::uint64_t truths() const noexcept { return head_->truths.load(std::memory_order_acquire); }
  // Reads a cycle's true pose. Returns false if the pose isn't written yet, or has been overwritten.
  bool truth(std::uint64_t cycle, BoxTruth& out) const noexcept;
  // Finds the oldest state after which all cycles are still in the box. Returns false if there is no such state.
  bool oldest_state(std::uint64_t& cycle, std::vector<std::byte>& state) const;
  // Returns the frames of the cycle that has begun and hasn't ended.
  [[nodiscard]] std::vector<BoxFrame> unfinished() const;

 protected:
  struct State {
    std::uint64_t cycle = 0;
    std::size_t size = 0;
    std::array<std::byte, most_state_bytes> bytes{};
  };
  static constexpr std::size_t state_count = 16;
  struct Head {
    std::uint64_t layout = 0;  // layout_of_this_program() in the program that wrote the box
    std::uint64_t cycle_capacity = 0, frame_capacity = 0;
    std::atomic<std::uint64_t> cycles{0}, frames{0}, states{0}, truths{0};
  };
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
  // Returns a number that differs between builds whose records differ in size.
  [[nodiscard]] static std::uint64_t layout_of_this_program() noexcept {
    return sizeof(BoxCycle) << 32U | sizeof(BoxFrame);
  }

  BoxReader() = default;
  ~BoxReader() = default;
  [[nodiscard]] static std::size_t bytes_for(std::size_t cycles, std::size_t frames) noexcept {
    return sizeof(Head) + cycles * (sizeof(BoxCycle) + sizeof(BoxTruth)) + frames * sizeof(BoxFrame) +
           state_count * sizeof(State);
  }
  // Sets the pointers to the rings behind `head`. Precondition: `head` holds the capacities.
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
    forked,  // for processes forked from this one
    // The memory is for any other process, too, that gets descriptor(). This memory counts against a limit of file
    // sizes.
    by_descriptor,
  };

  // `frames_per_cycle`: the largest expected number of frames in a cycle.
  BlackBox(double period_s, std::size_t frames_per_cycle, Memory memory = Memory::forked);
  ~BlackBox() override;

  [[nodiscard]] BoxCycle& begin(std::int64_t t_k_ns) noexcept override;
  void add(const BoxFrame& frame) noexcept override;
  void finish() noexcept override;
  [[nodiscard]] std::span<std::byte> state_room() noexcept override;
  void finish_state(std::size_t bytes) noexcept override;
  // Adds the newest cycle's true pose. The simulation calls this after the cycle.
  void add_truth(const Triple& tool_m, const std::array<double, 4>& tool_q) noexcept;

  // Returns the descriptor of the memory with Memory::by_descriptor, else −1. It is closed on exec, and when the box is
  // destroyed.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

 private:
  std::uint64_t cycles_per_state_;
  std::size_t bytes_;
  int descriptor_ = -1;
};

// Another process's black box, mapped read-only through the box's descriptor.
class MappedBox final : public BoxReader {
 public:
  // Throws std::runtime_error if the memory isn't a box of this build of the program.
  explicit MappedBox(int descriptor);
  ~MappedBox();

 private:
  void* memory_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace proxarm::controller
