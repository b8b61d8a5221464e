// Connects a simulated drive or sensor to its bus, an in-process bus (SimulatedCanNetwork) or, in a separate process, a
// CAN interface of the kernel. The owner of the bus gives the device a CanPort for sending and calls on_frame() for
// every frame of another node.
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

  // Queues the frame behind this node's earlier ones. Never blocks.
  virtual SendResult send(const CanFrame& frame) noexcept = 0;
};

class CanListener {
 public:
  CanListener() = default;
  CanListener(const CanListener&) = delete;
  CanListener& operator=(const CanListener&) = delete;
  virtual ~CanListener() = default;

  // Reports a frame of another node, complete on the wire at time_ns. May send and schedule events.
  virtual void on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;
};

}  // namespace proxarm::fieldbus
