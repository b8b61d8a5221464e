#include "fieldbus/can/frame_pump.hpp"

#include <algorithm>

namespace proxarm::fieldbus {

bool pump_frames(CanNetwork& network, std::int64_t deadline_ns, const FrameHandler& on_frame,
                 const std::function<std::int64_t(std::int64_t now_ns)>& work) {
  for (;;) {
    TimedFrame received;
    for (std::size_t bus = 0; bus < network.bus_count(); ++bus) {
      while (network.bus(bus).receive(received)) {
        if (on_frame) on_frame(bus, received);
      }
    }
    const std::int64_t now_ns = network.now_ns();
    const std::int64_t wake_ns = work(now_ns);
    if (wake_ns == pump_done) return true;
    if (now_ns >= deadline_ns) return false;
    network.wait_for_frame(std::min(deadline_ns, wake_ns));
  }
}

}  // namespace proxarm::fieldbus
