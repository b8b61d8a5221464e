// A simulated force sensor on UDP: gives a DescribedDevice's samples to a network, and the network's requests to the
// device. Only the thread of the physics uses it.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "fieldbus/udp/datagram_port.hpp"
#include "sim/bus/device_port.hpp"
#include "sim/devices/described_device.hpp"

namespace proxarm::sim {

// The device's end of a network. No function blocks.
class DatagramWire {
 public:
  DatagramWire() = default;
  DatagramWire(const DatagramWire&) = delete;
  DatagramWire& operator=(const DatagramWire&) = delete;
  virtual ~DatagramWire() = default;

  // Sends a sample to whoever sent the latest request. It is ready at ready_ns, which a real network ignores.
  virtual void send(std::span<const std::uint8_t> bytes, std::int64_t ready_ns) noexcept = 0;
  // Takes the oldest request; false if there is none.
  virtual bool take(fieldbus::Datagram& request) noexcept = 0;
};

class DatagramSensorDevice final : public DevicePort {
 public:
  void connect(DatagramWire& wire) noexcept { wire_ = &wire; }
  void disconnect(const DatagramWire& wire) noexcept {
    if (wire_ == &wire) wire_ = nullptr;
  }

  // Requests that one call of obey() reads: a sender that floods the device must not hold up the physics. A session
  // sends two at its start; the rest waits for the next call.
  static constexpr int most_requests = 256;

  // Gives the requests that have come to the device. Must be called at least once a millisecond.
  void obey(DescribedDevice& device, std::int64_t time_ns) noexcept;
  void send(const fieldbus::CanFrame& sample, std::int64_t ready_ns) noexcept override;

 private:
  DatagramWire* wire_ = nullptr;
};

// The port of a sensor in the same process and in virtual time. Both directions have a queue that drops what doesn't
// fit, as the kernel's do. Precondition: the device outlives the port.
class InProcessPort final : public fieldbus::DatagramPort, private DatagramWire {
 public:
  static constexpr std::int64_t on_the_way_ns = 50'000;  // from sensor to port: a small datagram through a switch

  explicit InProcessPort(DatagramSensorDevice& device) noexcept : device_(device) { device_.connect(*this); }
  ~InProcessPort() override { device_.disconnect(*this); }

  bool send(std::span<const std::uint8_t> bytes) noexcept override;
  bool receive(fieldbus::Datagram& out, std::int64_t now_ns) noexcept override;

 private:
  // A queue of datagrams in the order of their arrival. A full queue drops the newest, as the kernel's do.
  struct Queue {
    static constexpr std::size_t room = 128;
    std::array<fieldbus::Datagram, room> datagrams{};
    std::size_t first = 0, count = 0;

    bool push(std::span<const std::uint8_t> bytes, std::int64_t time_ns) noexcept;
    bool pop(fieldbus::Datagram& out, std::int64_t until_ns) noexcept;
  };

  void send(std::span<const std::uint8_t> bytes, std::int64_t ready_ns) noexcept override;
  bool take(fieldbus::Datagram& request) noexcept override;

  DatagramSensorDevice& device_;
  Queue to_port_, to_device_;
};

}  // namespace proxarm::sim
