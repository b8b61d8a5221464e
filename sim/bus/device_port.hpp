// Interfaces between a simulated device and its bus.
#pragma once

#include <cstdint>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::sim {

// Sends a device's frames. A device needs time to answer, so each frame has the time ready_ns at which it is sent. If
// ready_ns is in the past, the frame is sent now. Frames of one device with the same ready_ns leave in the order of the
// calls.
class DevicePort {
 public:
  DevicePort() = default;
  DevicePort(const DevicePort&) = delete;
  DevicePort& operator=(const DevicePort&) = delete;
  virtual ~DevicePort() = default;

  virtual void send(const fieldbus::CanFrame& frame, std::int64_t ready_ns) noexcept = 0;
};

// A device on a bus. Precondition for its functions: the times of successive calls never decrease.
class BusDevice {
 public:
  BusDevice() = default;
  BusDevice(const BusDevice&) = delete;
  BusDevice& operator=(const BusDevice&) = delete;
  virtual ~BusDevice() = default;

  // Switches the power on: the device restarts from its stored settings.
  virtual void power_on(std::int64_t time_ns) noexcept = 0;
  // Gets a frame of another node. The frame's last bit was on the wire at time_ns. The frame may contain any bytes.
  virtual void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept = 0;
  // Runs timers and sends periodic frames. Must be called at least once a millisecond.
  virtual void on_time(std::int64_t time_ns) noexcept = 0;
};

}  // namespace proxarm::sim
