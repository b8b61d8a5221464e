// How a node at the far end of the wire (a simulated drive or sensor) meets its bus.
//
// The same node runs on an in-process bus (SimulatedCanNetwork) or, in a process of its own, on an interface of the
// kernel: whoever owns the bus hands it a CanPort to send on and calls on_frame() for every frame of the others.
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

  // Queues the frame behind those that this node sent before. Never blocks.
  virtual SendResult send(const CanFrame& frame) noexcept = 0;
};

class CanListener {
 public:
  CanListener() = default;
  CanListener(const CanListener&) = delete;
  CanListener& operator=(const CanListener&) = delete;
  virtual ~CanListener() = default;

  // A frame of another node, complete on the wire at time_ns. May send and schedule events; own frames don't come back.
  virtual void on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;
};

}  // namespace proxarm::fieldbus
