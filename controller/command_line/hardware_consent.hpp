// Before drives are enabled on anything but a simulation: somebody must say that it is safe, and the cell must have an
// enabling input.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "controller/command_line/prepared_session.hpp"

namespace proxarm::command_line {

// How the machine is asked, so that tests can answer.
struct HardwareSurroundings {
  std::function<bool(const std::string& interface)> is_virtual;
  bool on_terminal = false;  // there is somebody who can type
  std::istream& in;
  std::ostream& out;
};

// Those that aren't vcan or vxcan, each once. (Modbus peers beyond this machine are refused by open_modbus().)
std::vector<std::string> real_interfaces(const std::vector<std::string>& interfaces,
                                         const HardwareSurroundings& surroundings);

// Returns where nothing is real, or where --hardware was given and the checklist confirmed. Throws SetupError that says
// what is missing.
void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces, const HardwareSurroundings& surroundings);
// With this process' terminal and kernel. The environment's PROXARM_TREAT_AS_REAL names virtual interfaces that are to
// be taken for real ones: to try all this out.
void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces);

}  // namespace proxarm::command_line
