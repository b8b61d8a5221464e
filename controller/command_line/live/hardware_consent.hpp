// Asks for consent before drives are enabled outside a simulation: a person must confirm that it is safe, and the cell
// must have an enabling input.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Queries of the machine, replaceable in tests.
struct HardwareSurroundings {
  std::function<bool(const std::string& interface)> is_virtual;
  std::function<bool(const description::ModbusLineDescription&)> is_on_this_machine;
  bool on_terminal = false;  // a person can type
  std::istream& in;
  std::ostream& out;
};

// Returns the CAN interfaces other than vcan and vxcan, each once.
std::vector<std::string> real_interfaces(const std::vector<std::string>& interfaces,
                                         const HardwareSurroundings& surroundings);
// Returns the Modbus lines with a drive or the sensor of the cell whose peer isn't a process on this machine.
std::vector<description::ModbusLineDescription> real_lines(const description::Cell& cell,
                                                           const HardwareSurroundings& surroundings);

// Returns if no interface or line is real, or if --hardware was given and the checklist confirmed. Otherwise throws
// SetupError that says what is missing.
void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces, const HardwareSurroundings& surroundings);
// The same with this process's terminal and kernel. For trying this out, the environment variable PROXARM_TREAT_AS_REAL
// lists virtual interfaces, and hosts and devices of Modbus lines, that count as real.
void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces);
// Returns whether an interface or a Modbus line of the cell counts as real in that sense.
bool is_real(const PreparedSession& session, const std::vector<std::string>& interfaces);

}  // namespace proxarm::command_line
