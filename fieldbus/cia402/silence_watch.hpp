// What a drive does when its controller falls silent, as a listener on the bus sees it.
//
// Before the silence the drive is asked to say more than in a session: its heartbeat, and where it can a third transmit
// PDO with its statusword, on a change and every 5 ms, since there is no SYNC any more that would bring the first. A
// drive that takes neither is told by its EMCY alone.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

// What the drives are asked to say in the silence; what one doesn't take is left out. Until the next set-up.
void ask_for_words(CanNetwork& network, std::span<const DriveSlot> drives);

// 6041h of each drive, read by SDO: also one that isn't in operational answers. Unknown: no answer.
[[nodiscard]] std::vector<DriveState> ask_for_states(CanNetwork& network, std::span<const DriveSlot> drives);

class SilenceWatch {
 public:
  explicit SilenceWatch(const ServoDrive& drive) noexcept : node_(drive.node()) {}

  // The identifier that is new on the bus.
  [[nodiscard]] std::uint32_t wanted_id() const noexcept;
  // Frames from the silence's beginning on, whoever's they are; noexcept, no heap.
  void on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept;

  // The first sign that it doesn't carry on: EMCY, another state than operation enabled, or another NMT state.
  [[nodiscard]] bool has_reacted() const noexcept { return reacted_ns_ >= 0; }
  [[nodiscard]] std::int64_t reacted_ns() const noexcept { return reacted_ns_; }
  // Its statusword said that it has no power any more; −1: it didn't say so.
  [[nodiscard]] std::int64_t off_ns() const noexcept { return off_ns_; }
  // "EMCY 8130h heartbeat error, NMT pre-operational".
  [[nodiscard]] std::string signs() const;

 private:
  void react(std::int64_t time_ns) noexcept;

  std::uint8_t node_;
  std::int64_t reacted_ns_ = -1, off_ns_ = -1;
  std::uint16_t emcy_ = 0, statusword_ = 0;
  NmtState nmt_ = NmtState::operational;
};

}  // namespace proxarm::fieldbus
