// Before drives are enabled on anything but a simulation: somebody must say that it is safe, and the cell must have an
// enabling input.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// How the machine is asked, so that tests can answer.
struct HardwareSurroundings {
  std::function<bool(const std::string& interface)> is_virtual;
  std::function<bool(const description::ModbusLineDescription&)> is_on_this_machine;
  bool on_terminal = false;  // there is somebody who can type
  std::istream& in;
  std::ostream& out;
};

// CAN interfaces that aren't vcan or vxcan, each once.
std::vector<std::string> real_interfaces(const std::vector<std::string>& interfaces,
                                         const HardwareSurroundings& surroundings);
// Modbus lines with a drive or the sensor of the cell whose peer isn't a process of this machine.
std::vector<description::ModbusLineDescription> real_lines(const description::Cell& cell,
                                                           const HardwareSurroundings& surroundings);

// Returns where nothing is real, or where --hardware was given and the checklist confirmed. Throws SetupError that says
// what is missing.
void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces, const HardwareSurroundings& surroundings);
// With this process' terminal and kernel. The environment's PROXARM_TREAT_AS_REAL names virtual interfaces, and hosts
// and devices of Modbus lines, that are to be taken for real ones: to try all this out.
void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces);
// Whether one of them, or a Modbus line of the cell, is real by the same words.
bool is_real(const PreparedSession& session, const std::vector<std::string>& interfaces);

}  // namespace proxarm::command_line
