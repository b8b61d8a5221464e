// Connects a simulated device to its bus: delivers frames to it, sends its frames when they are ready, and simulates
// faults of the connection.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/can/can_port.hpp"
#include "fieldbus/simulated/event_queue.hpp"
#include "sim/bus/device_port.hpp"

namespace proxarm::sim {

// Called before a frame reaches a device, so that the physics is advanced to the frame's time.
class Clockwork {
 public:
  virtual ~Clockwork() = default;
  virtual void advance_to(std::int64_t time_ns) noexcept = 0;
  // The frame, before the device gets it.
  virtual void seen(const fieldbus::CanFrame& /*frame*/, std::int64_t /*time_ns*/) noexcept {}
};

// One node. The device is set later, since it needs the node as its port.
class DeviceNode final : public fieldbus::CanListener, public DevicePort {
 public:
  DeviceNode(std::string name, std::size_t bus, fieldbus::EventQueue& events, Clockwork& clockwork);

  void set_device(BusDevice& device) noexcept { device_ = &device; }
  void connect(fieldbus::CanPort& port) noexcept { port_ = &port; }

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::size_t bus() const noexcept { return bus_; }  // index in the cell
  [[nodiscard]] std::uint64_t frames_sent() const noexcept { return frames_sent_; }
  [[nodiscard]] std::uint64_t frames_not_sent() const noexcept { return frames_not_sent_; }  // the port refused them

  // Disconnects the node in both directions. Counts, since several faults may cut it at the same time.
  void cut(bool cut) noexcept { cuts_ += cut ? 1 : -1; }
  // Without power the device doesn't run.
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
  std::vector<fieldbus::CanFrame> waiting_;  // frames that aren't ready yet; the places are reused
  std::vector<std::uint32_t> free_places_;
  std::uint64_t frames_sent_ = 0, frames_not_sent_ = 0;
  int cuts_ = 0;
  bool powered_ = false;
};

}  // namespace proxarm::sim
