// Ends a session: makes drives that are switched off stop waiting for the controller, before SYNC and heartbeat end.
// Without this goodbye every drive would send an EMCY (8130h: heartbeat lost; 8100h from stacks that watch SYNC in
// pre-operational too), and some drives would stay in fault.
//
// 1. The caller keeps sending SYNC, controlwords and heartbeat, and calls next_request() once per period.
// 2. A drive that reports that it is off gets 1016h:01 := 0 (it no longer watches the heartbeat; 100Ch := 0 if it uses
//    life guarding), then 1006h := 0 (it no longer watches SYNC).
// 3. When all drives have answered, or the time limit has passed, the caller calls leave_operational(), which ends the
//    timers of the receive PDOs. The caller then sends nothing more.
//
// A drive that isn't off gets no request. It keeps watching the controller and stops by itself. Refused and unanswered
// requests are ignored. Construct Goodbye before the cycle; its functions neither allocate, lock nor throw.
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
  // Returns true and the request that is due now, at most one unanswered request per bus; false if no request is due.
  [[nodiscard]] bool next_request(std::int64_t now_ns, std::size_t& bus, CanFrame& frame) noexcept;
  // True if the frame was an SDO answer of one of the drives.
  bool on_frame(std::size_t bus, const CanFrame& frame) noexcept;
  // True if all drives are finished or the time limit has passed.
  [[nodiscard]] bool done(std::int64_t now_ns) const noexcept;

 private:
  struct Node {
    std::uint8_t step = 0;  // index of the object to be written; watched_objects: finished
    bool waiting = false;
    std::int64_t deadline_ns = 0;
  };

  [[nodiscard]] bool is_off(const ServoDrive& drive, std::int64_t now_ns) const noexcept;
  [[nodiscard]] bool is_busy(std::size_t bus) const noexcept;

  std::vector<DriveSlot> drives_;
  std::vector<Node> nodes_;
  std::int64_t begun_ns_ = 0;
};

// Sends NMT enter pre-operational to each drive. Doesn't wait for the drives. Ignores errors, because at the end of the
// session no remedy is left.
void leave_operational(CanNetwork& network, std::span<const DriveSlot> drives) noexcept;

}  // namespace proxarm::fieldbus
