// Tells CiA 402 drives another period while the cycle runs and they stand: 60C2h, 1006h and the receive PDO's timer.
//
// Each object is written by an expedited SDO download and read back (CiA 301, 7.2.4.3); one request at a time on each
// bus, at most one per bus and cycle, so that a cycle's own frames are delayed by one frame at most. A drive that
// hasn't an object that the standard leaves to the maker goes without, as at the start. What a drive refuses, doesn't
// answer, or keeps at another value ends the exchange; take_back() then reads what those that were written to have, and
// writes the old period where it isn't that.
//
// 60C2h is two objects, value and exponent, and between the two writes the drive has a period that nobody wants. Their
// order is the one that makes it the longer one: SYNC is never slower than a drive expects, so its supervision keeps
// still. For that the caller's cycle runs at the shorter one of both periods as long as the exchange does.
//
// Made before the cycle; all else is for the cycle: it neither allocates, locks nor throws.
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

// Why a drive's period isn't what it was to be.
struct PeriodRefusal {
  std::int32_t drive = -1;  // among the slots; −1: no drive has
  std::uint16_t index = 0;  // the object
  std::uint8_t sub = 0;
  std::uint32_t code = 0;  // of the SDO abort; 05040000h: no answer; 0: it took the value but kept another
};

class PeriodExchange {
 public:
  explicit PeriodExchange(std::span<const DriveSlot> drives);

  // Begins; both periods are such that 60C2h and 1006h hold them.
  void tell(std::int64_t from_ns, std::int64_t to_ns) noexcept;
  // Whatever has been told so far: those drives back to the old one. Not before tell().
  void take_back() noexcept;

  // A request that is due now, to be sent by the caller; false: none (any more).
  [[nodiscard]] bool next_request(std::int64_t now_ns, std::size_t& bus, CanFrame& frame) noexcept;
  // True when the frame was an SDO answer of one of the drives.
  bool on_frame(std::size_t bus, const CanFrame& frame) noexcept;
  // Notices answers that are overdue.
  void on_cycle(std::int64_t now_ns) noexcept;

  [[nodiscard]] bool failed() const noexcept { return failed_; }
  [[nodiscard]] bool done() const noexcept;
  [[nodiscard]] const PeriodRefusal& refusal() const noexcept { return refusal_; }  // of the last failure
  void archive(StateArchive& state) noexcept;

 private:
  static constexpr std::uint8_t attempts = 2;  // a lost frame doesn't end it

  enum class Waiting : std::uint8_t { nothing, write, read };
  struct Node {
    bool wanted = false;   // takes part
    bool touched = false;  // was written to
    Waiting waiting = Waiting::nothing;
    bool written = false;  // the object of this step
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
  bool back_ = false;  // from_ns_ is what is told
  bool failed_ = false;
  PeriodRefusal refusal_;
};

}  // namespace proxarm::fieldbus
