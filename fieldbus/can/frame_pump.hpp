// Waiting for an answer before the cycle runs: receives on all buses of a network until something is so, or too late.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "fieldbus/can/can_network.hpp"

namespace proxarm::fieldbus {

// Gets every frame of every bus, in the order received per bus; none is lost while another is waited for.
using FrameHandler = std::function<void(std::size_t bus, const TimedFrame& frame)>;

// Calls `on_frame` for what comes in and `work(now_ns)` after each batch; `work` does what is due, and returns when it
// wants to be called next at the latest (absolute), or `pump_done` to end. True if it ended so, false at the deadline.
inline constexpr std::int64_t pump_done = -1;
bool pump_frames(CanNetwork& network, std::int64_t deadline_ns, const FrameHandler& on_frame,
                 const std::function<std::int64_t(std::int64_t now_ns)>& work);

}  // namespace proxarm::fieldbus
