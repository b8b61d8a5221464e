// Computes the worst-case response time of each frame of a bus. Part of bus_budget; bus_budget.hpp has the equations.
#pragma once

#include <cstdint>
#include <vector>

#include "fieldbus/budget/bus_budget.hpp"

namespace proxarm::fieldbus {

// When a frame can be pending: it is released in [release_ns, release_ns + jitter_ns] and off the wire by finish_ns.
// All times count from the cycle's start.
struct FrameWindow {
  std::int64_t release_ns = 0;
  std::int64_t jitter_ns = 0;
  std::int64_t finish_ns = 0;
  std::int64_t response_ns = 0;  // worst case, from the release to the end of the frame
  // false: the frame can wait longer than its repetition time, so it has no finite window.
  bool bounded = true;
  // The frame is out of step with the cycle, or comes after such a frame. release_ns is then 0, but the release may be
  // at any time.
  bool any_time = false;
};

// Returns the window of each frame. `triggers[i]` is the index of the frame that frame i comes after, −1 if it comes
// after no frame. Precondition: the bus has passed the checks of plan_bus().
[[nodiscard]] std::vector<FrameWindow> response_windows(const PlannedBus& bus, const std::vector<int>& triggers,
                                                        std::int64_t period_ns);

// Returns the number that arbitration compares. A lower number is a higher priority.
[[nodiscard]] std::uint64_t planned_priority(const PlannedFrame& frame) noexcept;

}  // namespace proxarm::fieldbus
