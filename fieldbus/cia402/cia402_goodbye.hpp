// The last words to CiA 402 drives: one that is off is told to wait for nobody any more, before SYNC and the
// controller's heartbeat end. Else each end would leave an EMCY in every drive (8130h: heartbeat lost; 8100h from
// stacks that watch SYNC in pre-operational, too), and those that keep it in fault.
//
//   the caller goes on with SYNC, controlwords and heartbeat, once a period, and asks for next_request()
//   a drive says that it is off: 1016h:01 := 0 (no heartbeat is consumed), then 1006h := 0 (no SYNC is expected)
//   all have answered, or time is up: leave_operational(), which ends the receive PDOs' timers, and silence
//
// A drive that isn't off is told nothing: it goes on watching, and stops by itself. What a drive refuses or doesn't
// answer is left at that; there is nothing more to be done for it.
//
// Made before the cycle; all else neither allocates, locks nor throws.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/can/can_network.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"

namespace proxarm::fieldbus {

class Goodbye {
 public:
  explicit Goodbye(std::span<const DriveSlot> drives);

  void begin(std::int64_t now_ns) noexcept;
  // A request that is due now, one at a time on each bus; false: none (any more).
  [[nodiscard]] bool next_request(std::int64_t now_ns, std::size_t& bus, CanFrame& frame) noexcept;
  // True when the frame was an SDO answer of one of the drives.
  bool on_frame(std::size_t bus, const CanFrame& frame) noexcept;
  // All drives have been told, or time is up.
  [[nodiscard]] bool done(std::int64_t now_ns) const noexcept;

 private:
  struct Node {
    std::uint8_t step = 0;  // into the objects; their number: told
    bool waiting = false;
    std::int64_t deadline_ns = 0;  // of the answer
  };

  [[nodiscard]] bool is_off(const ServoDrive& drive, std::int64_t now_ns) const noexcept;
  [[nodiscard]] bool is_busy(std::size_t bus) const noexcept;

  std::vector<DriveSlot> drives_;
  std::vector<Node> nodes_;
  std::int64_t begun_ns_ = 0;
};

// Doesn't wait and doesn't fail: there is nothing left to do if it can't be sent.
void leave_operational(CanNetwork& network, std::span<const DriveSlot> drives) noexcept;

}  // namespace proxarm::fieldbus
