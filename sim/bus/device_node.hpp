// Connects a simulated device to its bus. Delivers frames to the device, sends the device's frames when they are ready,
// and simulates faults of the connection.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/can/can_port.hpp"
#include "fieldbus/simulated/event_queue.hpp"
#include "sim/bus/device_port.hpp"

namespace proxarm::sim {

// Is called before a frame reaches a device, so that the physics can be advanced to the frame's time.
class Clockwork {
 public:
  virtual ~Clockwork() = default;
  virtual void advance_to(std::int64_t time_ns) noexcept = 0;
  // Gets each frame before the device gets it.
  virtual void seen(const fieldbus::CanFrame& /*frame*/, std::int64_t /*time_ns*/) noexcept {}
};

// One node of a bus. Its device is set later, because the device needs the node as its port.
class DeviceNode final : public fieldbus::CanListener, public DevicePort {
 public:
  DeviceNode(std::string name, std::size_t bus, fieldbus::EventQueue& events, Clockwork& clockwork);

  void set_device(BusDevice& device) noexcept { device_ = &device; }
  void connect(fieldbus::CanPort& port) noexcept { port_ = &port; }

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::size_t bus() const noexcept { return bus_; }  // index of the bus in the cell
  [[nodiscard]] std::uint64_t frames_sent() const noexcept { return frames_sent_; }
  // Number of frames that the port refused.
  [[nodiscard]] std::uint64_t frames_not_sent() const noexcept { return frames_not_sent_; }

  // Disconnects the node in both directions (true) or connects it again (false). Calls are counted, because several
  // faults may disconnect the node at the same time.
  void cut(bool cut) noexcept { cuts_ += cut ? 1 : -1; }
  // Switches the device on or off. Without power the device doesn't run.
  void set_power(bool on, std::int64_t time_ns) noexcept;

  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void on_time(std::int64_t time_ns) noexcept;
  void send(const fieldbus::CanFrame& frame, std::int64_t ready_ns) noexcept override;

 private:
  void send_now(const fieldbus::CanFrame& frame) noexcept;
  void send_waiting(std::uint32_t place) noexcept;

  std::string name_;
  std::size_t bus_;
  fieldbus::EventQueue& events_;
  Clockwork& clockwork_;
  BusDevice* device_ = nullptr;
  fieldbus::CanPort* port_ = nullptr;
  std::vector<fieldbus::CanFrame> waiting_;  // frames that aren't ready yet; places are reused
  std::vector<std::uint32_t> free_places_;
  std::uint64_t frames_sent_ = 0, frames_not_sent_ = 0;
  int cuts_ = 0;
  bool powered_ = false;
};

}  // namespace proxarm::sim
