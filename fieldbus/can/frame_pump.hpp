// Receives on all buses of a network until a condition holds or a deadline passes. Not for use in the cycle.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "fieldbus/can/can_network.hpp"

namespace proxarm::fieldbus {

// Gets every frame of every bus; the frames of one bus come in the order of their reception. A handler that waits for
// one frame also gets all other frames, so none is lost.
using FrameHandler = std::function<void(std::size_t bus, const TimedFrame& frame)>;

// Calls `on_frame` for each received frame and `work(now_ns)` after each batch of frames. `work` returns the absolute
// time of its next call at the latest, or `pump_done` to end the loop. Returns true if `work` ended the loop, false at
// the deadline.
inline constexpr std::int64_t pump_done = -1;
bool pump_frames(CanNetwork& network, std::int64_t deadline_ns, const FrameHandler& on_frame,
                 const std::function<std::int64_t(std::int64_t now_ns)>& work);

}  // namespace proxarm::fieldbus
