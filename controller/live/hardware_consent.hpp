// Asks for consent before drives are enabled outside a simulation: a person must confirm that it is safe, and the cell
// must have an enabling input.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "controller/preparation/prepared_session.hpp"
#include "fieldbus/udp/udp_port.hpp"

namespace proxarm::controller {

// What the consent needs to know of the machine; tests replace it.
struct HardwareSurroundings {
  std::function<bool(const std::string& interface)> is_virtual;
  std::function<bool(const description::ModbusLineDescription&)> is_on_this_machine;
  std::function<bool(const fieldbus::UdpPeer&)> is_udp_here;
  bool on_terminal = false;  // whether a person can type an answer
  std::istream& in;
  std::ostream& out;
};

// Returns those of the CAN interfaces that are neither vcan nor vxcan, each once.
std::vector<std::string> real_interfaces(const std::vector<std::string>& interfaces,
                                         const HardwareSurroundings& surroundings);
// Returns the Modbus lines with a drive or the sensor of the cell whose peer isn't a process on this machine.
std::vector<description::ModbusLineDescription> real_lines(const description::Cell& cell,
                                                           const HardwareSurroundings& surroundings);

// Returns the addresses of UDP devices of the cell, other than processes on this machine: the force sensor's, or none.
std::vector<fieldbus::UdpPeer> real_udp_peers(const PreparedSession& session, const HardwareSurroundings& surroundings);

// Returns normally if no interface, Modbus line or UDP address is real, or if --hardware was given and the checklist
// was confirmed. Otherwise throws a SetupError that says what is missing.
void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces, const HardwareSurroundings& surroundings);
// Requires consent as above, with this process's terminal and kernel. To try the consent out without real hardware, the
// environment variable PROXARM_TREAT_AS_REAL lists virtual interfaces, hosts and devices of Modbus lines, and UDP
// addresses, that count as real.
void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces);
// Returns whether one of the interfaces, a Modbus line or a UDP address of the cell is real or counts as real by
// PROXARM_TREAT_AS_REAL.
bool is_real(const PreparedSession& session, const std::vector<std::string>& interfaces);

}  // namespace proxarm::controller
