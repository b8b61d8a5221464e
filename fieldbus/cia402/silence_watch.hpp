// Observes on the bus how a drive reacts when its controller falls silent.
//
// Before the silence, the drive is asked to report more than in a session: a heartbeat and, if possible, its statusword
// in TPDO3. It sends TPDO3 on a change and every 5 ms; TPDO1 isn't enough, because it ends with SYNC. A drive that
// refuses both reports is observed by its EMCY alone.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

// Configures the drives' additional reports, which last until the next set-up. Refusals are ignored.
void ask_for_words(CanNetwork& network, std::span<const DriveSlot> drives);

// Reads the state (6041h) of each drive by SDO, which works outside of NMT operational too. Returns DriveState::unknown
// for a drive that doesn't answer.
[[nodiscard]] std::vector<DriveState> ask_for_states(CanNetwork& network, std::span<const DriveSlot> drives);

class SilenceWatch {
 public:
  explicit SilenceWatch(const ServoDrive& drive) noexcept : node_(drive.node()) {}

  // Returns the identifier of TPDO3.
  [[nodiscard]] std::uint32_t wanted_id() const noexcept;
  // Must be called for all frames from the beginning of the silence on. Doesn't allocate.
  void on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept;

  // True after the first sign that the drive stops: an EMCY other than 8100h, another state than operation enabled, or
  // another NMT state than operational.
  [[nodiscard]] bool has_reacted() const noexcept { return reacted_ns_ >= 0; }
  [[nodiscard]] std::int64_t reacted_ns() const noexcept { return reacted_ns_; }
  // Returns when the drive's statusword first reported that the drive has no power; −1 if it didn't.
  [[nodiscard]] std::int64_t off_ns() const noexcept { return off_ns_; }
  // Returns the observed signs, such as "EMCY 8130h (heartbeat error), NMT pre-operational".
  [[nodiscard]] std::string signs() const;

 private:
  void react(std::int64_t time_ns) noexcept;

  std::uint8_t node_;
  std::int64_t reacted_ns_ = -1, off_ns_ = -1;
  std::uint16_t emcy_ = 0, statusword_ = 0;
  NmtState nmt_ = NmtState::operational;
};

}  // namespace proxarm::fieldbus
