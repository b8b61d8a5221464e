// Connects a simulated drive or sensor to its bus. The bus is either in-process (SimulatedCanNetwork) or, if the device
// runs in a separate process, a CAN interface of the kernel. The owner of the bus gives the device a CanPort for
// sending and calls the device's on_frame() for every frame of another node.
#pragma once

#include <cstdint>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/can/can_network.hpp"

namespace proxarm::fieldbus {

class CanPort {
 public:
  CanPort() = default;
  CanPort(const CanPort&) = delete;
  CanPort& operator=(const CanPort&) = delete;
  virtual ~CanPort() = default;

  // Queues the frame behind the frames that this node sent earlier. Never blocks.
  virtual SendResult send(const CanFrame& frame) noexcept = 0;
};

class CanListener {
 public:
  CanListener() = default;
  CanListener(const CanListener&) = delete;
  CanListener& operator=(const CanListener&) = delete;
  virtual ~CanListener() = default;

  // Handles a frame of another node. The frame's last bit was on the wire at time_ns. The function may send frames and
  // schedule events.
  virtual void on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;
};

}  // namespace proxarm::fieldbus
