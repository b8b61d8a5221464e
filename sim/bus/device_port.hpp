// What a simulated device sees of its bus: something that carries frames away.
#pragma once

#include <cstdint>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::sim {

// A device answers at a time of its own (its firmware needs a while), so every frame is handed over with the moment at
// which it is ready to be sent. That moment may lie in the future; one in the past means now. Frames of one device that
// are ready at the same time leave in the order of the calls.
class DevicePort {
 public:
  DevicePort() = default;
  DevicePort(const DevicePort&) = delete;
  DevicePort& operator=(const DevicePort&) = delete;
  virtual ~DevicePort() = default;

  virtual void send(const fieldbus::CanFrame& frame, std::int64_t ready_ns) noexcept = 0;
};

// A device on a bus. Time only moves forward from one call to the next.
class BusDevice {
 public:
  BusDevice() = default;
  BusDevice(const BusDevice&) = delete;
  BusDevice& operator=(const BusDevice&) = delete;
  virtual ~BusDevice() = default;

  // The supply comes up: what the device was comes to an end, and it starts from its stored settings.
  virtual void power_on(std::int64_t time_ns) noexcept = 0;
  // A frame that somebody else sent on the device's bus, complete at time_ns. Any bytes at all may come.
  virtual void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept = 0;
  // Time has come to time_ns: timers run out, periodic frames leave. Called at least once a millisecond.
  virtual void on_time(std::int64_t time_ns) noexcept = 0;
};

}  // namespace proxarm::sim
