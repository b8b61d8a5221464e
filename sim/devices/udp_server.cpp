#include "sim/devices/udp_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "models/base/network_address.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::sim {

UdpServer::UdpServer(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1 || !description::is_loopback(host)) {
    throw description::SetupError(
        {.key = "sensor.host", .found = host, .expected = "a loopback address, 127.x.x.x, for a simulated sensor"});
  }
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  socklen_t size = sizeof address;
  if (socket_ < 0 || bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const description::SetupError error(
        {.key = "sensor.port",
         .message = "the simulated sensor's UDP port can't be opened",
         .found = host + ", port " + std::to_string(port) + ": " + std::strerror(errno)});
    if (socket_ >= 0) close(socket_);
    throw error;
  }
  port_ = ntohs(address.sin_port);
}

UdpServer::~UdpServer() { close(socket_); }

void UdpServer::send(std::span<const std::uint8_t> bytes, std::int64_t) noexcept {
  if (peer_host_ == 0) return;
  sockaddr_in peer{};
  peer.sin_family = AF_INET;
  peer.sin_port = peer_port_;
  peer.sin_addr.s_addr = peer_host_;
  // If nobody listens there any more, the call fails, and the sensor sends on.
  (void)sendto(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&peer),
               sizeof peer);
}

bool UdpServer::take(fieldbus::Datagram& request) noexcept {
  sockaddr_in peer{};
  // A call can fail by an ICMP message of any kind about a sample that was sent before, while requests wait.
  for (int attempt = 0; attempt < 3; ++attempt) {
    socklen_t size = sizeof peer;
    const ssize_t bytes =
        recvfrom(socket_, request.data.data(), request.data.size(), 0, reinterpret_cast<sockaddr*>(&peer), &size);
    if (bytes >= 0) {
      request.bytes = static_cast<std::size_t>(bytes);
      peer_host_ = peer.sin_addr.s_addr;
      peer_port_ = peer.sin_port;
      return true;
    }
    if (errno == EAGAIN || errno == EWOULDBLOCK) return false;
  }
  return false;
}

}  // namespace proxarm::sim
