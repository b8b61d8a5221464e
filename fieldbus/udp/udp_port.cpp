#include "fieldbus/udp/udp_port.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "models/base/network_address.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

// Room for some 170 small datagrams (the kernel doubles it, and counts about 768 bytes for each). The kernel drops what
// doesn't fit, so after a pause of the reader at most so many old datagrams wait.
constexpr int receive_buffer_bytes = 64 * 1024;

std::int64_t clock_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

SetupError problem(const UdpPeer& peer, const std::string& what) {
  return SetupError({.bus = "UDP " + peer.host,
                     .message = what,
                     .found = peer_text(peer) + ": " + std::strerror(errno),
                     .advice = "is the network up, and sensor.host the sensor's address?"});
}

class Socket {
 public:
  explicit Socket(const UdpPeer& peer) : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    if (fd_ < 0) throw problem(peer, "a UDP socket can't be opened");
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { close(fd_); }
  [[nodiscard]] int fd() const noexcept { return fd_; }

 private:
  int fd_;
};

class UdpPort final : public DatagramPort {
 public:
  explicit UdpPort(const UdpPeer& peer) : socket_(peer) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(peer.port));
    errno = EINVAL;
    if (inet_pton(AF_INET, peer.host.c_str(), &address.sin_addr) != 1) throw problem(peer, "no IPv4 address");
    const int on = 1;
    setsockopt(socket_.fd(), SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
    setsockopt(socket_.fd(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
    // From here on the kernel lets through only what comes from this address and port.
    if (connect(socket_.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw problem(peer, "the force sensor's address can't be reached");
    }
  }

  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    // An ICMP message about an earlier datagram ("nobody listens there", "no route") fails one call, with one of many
    // errors: it says nothing of this datagram.
    for (int attempt = 0; attempt < 2; ++attempt) {
      if (::send(socket_.fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size())) {
        return true;
      }
      if (errno == EAGAIN || errno == EWOULDBLOCK) return false;
    }
    return false;
  }

  bool receive(Datagram& out, std::int64_t now_ns) noexcept override {
    // A call may fail by an ICMP message of any kind, or by an interrupt, while datagrams wait.
    for (int attempt = 0; attempt < 3; ++attempt) {
      iovec part{.iov_base = out.data.data(), .iov_len = out.data.size()};
      alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(timespec))> control;
      msghdr message{};
      message.msg_iov = &part;
      message.msg_iovlen = 1;
      message.msg_control = control.data();
      message.msg_controllen = control.size();
      const ssize_t bytes = recvmsg(socket_.fd(), &message, 0);
      if (bytes >= 0) {
        out.bytes = static_cast<std::size_t>(bytes);
        out.time_ns = stamp(message, now_ns);
        return true;
      }
      if (errno == EAGAIN || errno == EWOULDBLOCK) return false;
    }
    return false;
  }

 private:
  // Returns the datagram's age by CLOCK_REALTIME, subtracted from the present CLOCK_MONOTONIC. Without a time stamp,
  // the datagram counts as received at now_ns.
  static std::int64_t stamp(msghdr& message, std::int64_t now_ns) noexcept {
    for (cmsghdr* control = CMSG_FIRSTHDR(&message); control != nullptr; control = CMSG_NXTHDR(&message, control)) {
      if (control->cmsg_level != SOL_SOCKET || control->cmsg_type != SO_TIMESTAMPNS) continue;
      timespec received{};
      std::memcpy(&received, CMSG_DATA(control), sizeof received);
      const std::int64_t received_ns = std::int64_t{received.tv_sec} * 1'000'000'000 + received.tv_nsec;
      return clock_ns(CLOCK_MONOTONIC) - std::max<std::int64_t>(clock_ns(CLOCK_REALTIME) - received_ns, 0);
    }
    return now_ns;
  }

  Socket socket_;
};

}  // namespace

std::string peer_text(const UdpPeer& peer) { return peer.host + ", UDP port " + std::to_string(peer.port); }

bool is_on_this_machine(const UdpPeer& peer) { return description::is_loopback(peer.host); }

UdpPeer peer_of(const description::SensorPlacement& sensor, const description::SensorDescription& file) {
  return {sensor.host, sensor.port != 0 ? sensor.port : file.described->datagrams->port};
}

std::unique_ptr<DatagramPort> open_udp(const UdpPeer& peer, UdpPeers peers) {
  if (peers == UdpPeers::on_this_machine && !is_on_this_machine(peer)) {
    throw SetupError({.key = "sensor.host",
                      .message = "this force sensor isn't a process of this machine: a real arm would move",
                      .found = peer.host,
                      .expected = "a loopback address, 127.x.x.x"});
  }
  return std::make_unique<UdpPort>(peer);
}

}  // namespace proxarm::fieldbus
