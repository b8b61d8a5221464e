// Interfaces between a simulated device and its bus.
#pragma once

#include <cstdint>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::sim {

// Sends a device's frames. A device needs time to answer, so each frame has the time at which it is ready to be sent; a
// time in the past means now. Frames of one device with the same time leave in the order of the calls.
class DevicePort {
 public:
  DevicePort() = default;
  DevicePort(const DevicePort&) = delete;
  DevicePort& operator=(const DevicePort&) = delete;
  virtual ~DevicePort() = default;

  virtual void send(const fieldbus::CanFrame& frame, std::int64_t ready_ns) noexcept = 0;
};

// A device on a bus. The times of successive calls never decrease.
class BusDevice {
 public:
  BusDevice() = default;
  BusDevice(const BusDevice&) = delete;
  BusDevice& operator=(const BusDevice&) = delete;
  virtual ~BusDevice() = default;

  // Power comes on: the device restarts from its stored settings.
  virtual void power_on(std::int64_t time_ns) noexcept = 0;
  // A frame of another node, complete at time_ns. May contain any bytes.
  virtual void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept = 0;
  // Runs timers and sends periodic frames. Called at least once a millisecond.
  virtual void on_time(std::int64_t time_ns) noexcept = 0;
};

}  // namespace proxarm::sim
