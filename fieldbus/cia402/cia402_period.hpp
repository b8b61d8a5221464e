// Changes the period of CiA 402 drives while the cycle runs and the drives stand still: 60C2h, 1006h and the timer of
// the receive PDO.
//
// Each object is written by an expedited SDO download and read back (CiA 301, 7.2.4.3). At most one request per bus and
// cycle is sent, which delays the cycle's frames by at most one frame. Missing optional objects are left out. The
// exchange fails if a drive refuses a request, doesn't answer, or keeps another value than the one written. After a
// failure, take_back() restores the old period in the objects that were written.
//
// 60C2h consists of two objects, value and exponent, so between the two writes the drive has an interim period. Of the
// two possible interim periods, the order of the writes chooses the longer one. SYNC then never comes later than the
// drive expects it, so the drive's supervision doesn't trip. Precondition: during the exchange, the cycle runs at the
// shorter of the old and the new period.
//
// Construct PeriodExchange before the cycle; its functions neither allocate, lock nor throw.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::fieldbus {

struct PeriodRefusal {
  std::int32_t drive = -1;  // index of the drive's slot; −1: no refusal
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  // SDO abort code. 05040000h: the drive didn't answer. 0: the drive accepted the value but kept another one.
  std::uint32_t code = 0;
};

class PeriodExchange {
 public:
  explicit PeriodExchange(std::span<const DriveSlot> drives);

  // Begins the change of all drives from `from_ns` to `to_ns`. Precondition: 60C2h and 1006h can hold both periods.
  void tell(std::int64_t from_ns, std::int64_t to_ns) noexcept;
  // Begins to restore the old period in the drives that were changed so far. Precondition: tell() was called.
  void take_back() noexcept;

  // Returns true and the request that must be sent now; false if no request is due.
  [[nodiscard]] bool next_request(std::int64_t now_ns, std::size_t& bus, CanFrame& frame) noexcept;
  // True if the frame was an SDO answer of one of the drives.
  bool on_frame(std::size_t bus, const CanFrame& frame) noexcept;
  // Detects missing answers. Must be called once per cycle.
  void on_cycle(std::int64_t now_ns) noexcept;

  [[nodiscard]] bool failed() const noexcept { return failed_; }
  [[nodiscard]] bool done() const noexcept;
  // The refusal that caused the last failure.
  [[nodiscard]] const PeriodRefusal& refusal() const noexcept { return refusal_; }
  void archive(StateArchive& state) noexcept;

 private:
  static constexpr std::uint8_t attempts = 2;  // attempts per request; one lost frame doesn't make the exchange fail

  enum class Waiting : std::uint8_t { nothing, write, read };
  struct Node {
    bool wanted = false;
    bool touched = false;
    Waiting waiting = Waiting::nothing;
    bool written = false;  // the drive has confirmed writing the object of this step
    bool read_next = false;
    std::uint8_t step = 0;
    std::uint8_t attempt = 0;
    std::int64_t deadline_ns = 0;
  };

  [[nodiscard]] PeriodStep step_of(std::size_t drive) const noexcept;
  void restart() noexcept;
  void skip_unchanged(std::size_t drive) noexcept;
  void advance(std::size_t drive) noexcept;
  void fail(std::size_t drive, std::uint32_t code) noexcept;
  void on_answer(std::size_t drive, const CanFrame& frame) noexcept;
  void on_value(std::size_t drive, const CanFrame& frame) noexcept;

  std::vector<DriveSlot> drives_;
  std::vector<Node> nodes_;
  std::int64_t from_ns_ = 0, to_ns_ = 0;
  bool back_ = false;  // the old period from_ns_ is being restored
  bool failed_ = false;
  PeriodRefusal refusal_;
};

}  // namespace proxarm::fieldbus
