// Worst-case response time of each frame of a bus. Part of bus_budget, which has the equations.
#pragma once

#include <cstdint>
#include <vector>

#include "fieldbus/budget/bus_budget.hpp"

namespace proxarm::fieldbus {

// When a frame can be pending: released in [release_ns, release_ns + jitter_ns], off the wire by finish_ns, all counted
// from the cycle's start.
struct FrameWindow {
  std::int64_t release_ns = 0;
  std::int64_t jitter_ns = 0;
  std::int64_t finish_ns = 0;
  std::int64_t response_ns = 0;  // worst case, from release to the end of the frame
  bool bounded = true;
  bool any_time = false;  // out of step, or comes after such a frame; release_ns is 0 and stands for any time
};

// Precondition: the bus is checked. `triggers[i]` is the index of the frame that i comes after, -1 if none.
[[nodiscard]] std::vector<FrameWindow> response_windows(const PlannedBus& bus, const std::vector<int>& triggers,
                                                        std::int64_t period_ns);

// The value that arbitration compares; a lower value is a higher priority.
[[nodiscard]] std::uint64_t planned_priority(const PlannedFrame& frame) noexcept;

}  // namespace proxarm::fieldbus
