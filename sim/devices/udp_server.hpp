// The network of a simulated force sensor: a UDP port of the loopback interface. It answers whoever sent the latest
// request, as the sensor does, and is used by the thread of the physics alone.
#pragma once

#include <string>

#include "sim/devices/datagram_sensor_device.hpp"

namespace proxarm::sim {

class UdpServer final : public DatagramWire {
 public:
  // Opens the port. `host` must be a loopback address; port 0 means any free port. Throws SetupError.
  UdpServer(const std::string& host, int port);
  ~UdpServer() override;

  [[nodiscard]] int port() const noexcept { return port_; }

  void send(std::span<const std::uint8_t> bytes, std::int64_t ready_ns) noexcept override;
  bool take(fieldbus::Datagram& request) noexcept override;

 private:
  int socket_ = -1, port_ = 0;
  std::uint32_t peer_host_ = 0;  // in network byte order; 0: no request has come
  std::uint16_t peer_port_ = 0;
};

}  // namespace proxarm::sim
