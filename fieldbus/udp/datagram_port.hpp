// One end of a conversation in datagrams with one peer, independent of the network. UdpPort is the kernel's; a
// simulated sensor has its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace proxarm::fieldbus {

struct Datagram {
  // One byte more than the longest datagram that a sensor's file can describe: so a datagram that is too long shows.
  static constexpr std::size_t most_bytes = 65;

  std::array<std::uint8_t, most_bytes> data{};
  std::size_t bytes = 0;     // of a longer datagram, only the first `most_bytes` are kept
  std::int64_t time_ns = 0;  // when the datagram arrived, by the clock of the session's network

  [[nodiscard]] std::span<const std::uint8_t> view() const noexcept { return {data.data(), bytes}; }
};

// No function blocks, allocates or throws. Only one thread may use a port.
class DatagramPort {
 public:
  DatagramPort() = default;
  DatagramPort(const DatagramPort&) = delete;
  DatagramPort& operator=(const DatagramPort&) = delete;
  virtual ~DatagramPort() = default;

  // Returns false if the datagram couldn't be sent.
  virtual bool send(std::span<const std::uint8_t> bytes) noexcept = 0;
  // Takes the oldest received datagram out of the queue; false if the queue is empty. `now_ns` is the time of the
  // session's network.
  virtual bool receive(Datagram& out, std::int64_t now_ns) noexcept = 0;
};

// A port that sends nothing and receives nothing.
class NoDatagrams final : public DatagramPort {
 public:
  bool send(std::span<const std::uint8_t>) noexcept override { return false; }
  bool receive(Datagram&, std::int64_t) noexcept override { return false; }
};

}  // namespace proxarm::fieldbus
