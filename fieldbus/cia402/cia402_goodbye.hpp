// Ends a session: before SYNC and heartbeat end, makes drives that are off stop waiting for the controller. Otherwise
// every drive would send an EMCY (8130h: heartbeat lost; 8100h from stacks that watch SYNC in pre-operational, too),
// and some would stay in fault.
//
//   the caller keeps sending SYNC, controlwords and heartbeat, and asks for next_request() once a period
//   a drive reports that it is off: 1016h:01 := 0 (no heartbeat is consumed), then 1006h := 0 (no SYNC is expected)
//   all have answered, or time is up: leave_operational(), which ends the receive PDOs' timers, and silence
//
// A drive that isn't off gets no request: it keeps watching, and stops by itself. Refused and unanswered requests are
// ignored. Construct before the cycle; the functions neither allocate, lock nor throw.
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
  // The request that is due now, one at a time on each bus; false if none is.
  [[nodiscard]] bool next_request(std::int64_t now_ns, std::size_t& bus, CanFrame& frame) noexcept;
  // True if the frame was an SDO answer of one of the drives.
  bool on_frame(std::size_t bus, const CanFrame& frame) noexcept;
  // True if all drives are finished, or time is up.
  [[nodiscard]] bool done(std::int64_t now_ns) const noexcept;

 private:
  struct Node {
    std::uint8_t step = 0;  // index of the object; their number: finished
    bool waiting = false;
    std::int64_t deadline_ns = 0;
  };

  [[nodiscard]] bool is_off(const ServoDrive& drive, std::int64_t now_ns) const noexcept;
  [[nodiscard]] bool is_busy(std::size_t bus) const noexcept;

  std::vector<DriveSlot> drives_;
  std::vector<Node> nodes_;
  std::int64_t begun_ns_ = 0;
};

// Doesn't wait; ignores errors, since nothing could be done about them.
void leave_operational(CanNetwork& network, std::span<const DriveSlot> drives) noexcept;

}  // namespace proxarm::fieldbus
