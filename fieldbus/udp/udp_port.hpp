// A UDP socket that is connected to one peer. The kernel drops datagrams of any other sender, and the port sends to
// nobody else.
//
// A datagram's time stamp is set by the kernel at reception (SO_TIMESTAMPNS, CLOCK_REALTIME) and converted to
// CLOCK_MONOTONIC, the clock of SocketCanNetwork. If CLOCK_REALTIME was set in between, the stamp is wrong by that
// step, but never in the future. The kernel begins to stamp at reception shortly after the first socket of the machine
// asked for it, later on a busy machine; until then a datagram has the time at which it was read.
#pragma once

#include <memory>
#include <string>

#include "fieldbus/udp/datagram_port.hpp"
#include "models/description/cell.hpp"
#include "models/description/sensor.hpp"

namespace proxarm::fieldbus {

struct UdpPeer {
  std::string host;  // numeric IPv4 address
  int port = 0;

  bool operator==(const UdpPeer&) const = default;
};

// Returns the address of a cell's sensor on UDP; `file` is the sensor's own, which has a port if the cell has none.
// Precondition: the file describes datagrams.
[[nodiscard]] UdpPeer peer_of(const description::SensorPlacement& sensor, const description::SensorDescription& file);

// Returns the peer's address, such as "192.168.1.1, UDP port 49152".
[[nodiscard]] std::string peer_text(const UdpPeer& peer);

// True for 127.x.x.x. If a process of this machine forwards the datagrams to a real device, this can't be detected.
[[nodiscard]] bool is_on_this_machine(const UdpPeer& peer);

enum class UdpPeers {
  on_this_machine,
  any,  // the user has confirmed that a real arm may move
};

// Opens a socket to the peer and sends nothing. Throws SetupError if the socket can't be opened, or if `peers` doesn't
// allow the peer.
[[nodiscard]] std::unique_ptr<DatagramPort> open_udp(const UdpPeer& peer, UdpPeers peers = UdpPeers::on_this_machine);

}  // namespace proxarm::fieldbus
