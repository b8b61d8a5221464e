#include "controller/live/hardware_consent.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <sstream>

#include "controller/preparation/proof_file.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "fieldbus/modbus/modbus_client.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {
namespace {

using description::number_text;
using description::SetupError;

constexpr const char* confirmation = "checked";

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string enabling_text(const PreparedSession& session) {
  const auto& input = session.cell.enabling_input;
  if (!input || session.settings.without_enabling_input)
    return "NONE (--without-enabling-input): nothing but the E-stop";
  if (!input->drive.empty()) return "bit " + std::to_string(input->bit) + " of the inputs of " + input->drive;
  std::ostringstream text;
  text << "identifier " << std::hex << input->identifier << "h on bus " << input->bus;
  return text.str();
}

// Prints what the person must have checked. `real` names the real interfaces, the real Modbus peers and a real sensor's
// UDP address; `lines`: some of them are Modbus peers.
void print_checklist(const PreparedSession& session, const std::vector<std::string>& real, bool lines,
                     std::ostream& out) {
  const description::CellLimits& limits = session.cell.limits;
  const bool box = limits.workspace_min_m[0] > -1e300 && limits.workspace_max_m[0] < 1e300;
  out << "This will enable the drives of a real arm on " << list(real) << ". It is no safety function. Check that\n"
      << "  1. the E-stop and STO act in hardware, on all drives, and have been tried today\n"
      << "  2. the enabling input has been tried: " << enabling_text(session) << "\n"
      << "  3. brakes hold the arm without power, and people know how to get free: docs/reference/supervision.md\n"
      << "  4. the limits are this arm's: tool " << number_text(limits.max_tool_speed_m_per_s) << " m/s and "
      << number_text(limits.max_tool_acceleration_m_per_s2) << " m/s2, force " << number_text(limits.max_force_N)
      << " N, power " << number_text(limits.max_power_W) << " W, workspace " << (box ? "set" : "NOT SET") << "\n"
      << "  5. the first try is slow: max_tool_speed_m_per_s at most 0.25, as ISO 10218-1 has it for setting up\n"
      << "  6. directions, counts, gears, offsets and ranges of all " << session.cell.drives.size()
      << " drives were compared with the arm, joint by joint\n"
      << "  7. nobody but the person at the handle is in reach of the arm, and somebody is at the E-stop\n";
  if (lines) {
    out << "  8. each Modbus drive stops by its own communication timeout: it is set, and its cable was pulled in slow "
           "motion\n";
  }
  out << std::flush;
}

void require_enabling_input(const PreparedSession& session) {
  if (session.cell.enabling_input || session.settings.without_enabling_input) return;
  throw SetupError({.file = session.cell.file.string(),
                    .key = "enabling_input",
                    .found = "none",
                    .expected = "one: real drives are enabled only while somebody presses a switch",
                    .advice = "see docs/reference/supervision.md; without one, on your own responsibility: "
                              "--without-enabling-input"});
}

[[noreturn]] void refuse(const std::vector<std::string>& interfaces,
                         const std::vector<description::ModbusLineDescription>& lines,
                         const std::vector<fieldbus::UdpPeer>& udp) {
  const std::string advice = "; for a real arm --hardware, which shows what must be checked before";
  if (!interfaces.empty()) {
    throw SetupError({.bus = interfaces.front(),
                      .message = "this is no virtual CAN interface (vcan, vxcan): a real arm would move",
                      .advice = "use --bus sim or vcan" + advice});
  }
  if (lines.empty()) {
    throw SetupError({.key = "sensor.host",
                      .message = "this force sensor isn't a process of this machine: a real arm would move",
                      .found = udp.front().host,
                      .expected = "a loopback address, 127.x.x.x",
                      .advice = "use --bus sim or such an address" + advice});
  }
  throw SetupError({.bus = lines.front().name,
                    .message = "this Modbus peer isn't a process of this machine: a real axis would move",
                    .found = fieldbus::peer_text(lines.front()),
                    .expected = "a loopback address, 127.x.x.x, or a pseudo-terminal, /dev/pts/N",
                    .advice = "use --bus sim or such a peer" + advice});
}

}  // namespace

std::vector<std::string> real_interfaces(const std::vector<std::string>& interfaces,
                                         const HardwareSurroundings& surroundings) {
  std::vector<std::string> real;
  for (const std::string& interface : interfaces) {
    const bool known = std::find(real.begin(), real.end(), interface) != real.end();
    if (!known && !surroundings.is_virtual(interface)) real.push_back(interface);
  }
  return real;
}

std::vector<description::ModbusLineDescription> real_lines(const description::Cell& cell,
                                                           const HardwareSurroundings& surroundings) {
  std::vector<description::ModbusLineDescription> real;
  for (const description::ModbusLineDescription& line : cell.modbus_lines) {
    const bool used = line.name == cell.sensor.bus ||
                      std::any_of(cell.drives.begin(), cell.drives.end(),
                                  [&](const description::DriveDescription& drive) { return drive.bus == line.name; });
    if (used && !surroundings.is_on_this_machine(line)) real.push_back(line);
  }
  return real;
}

std::vector<fieldbus::UdpPeer> real_udp_peers(const PreparedSession& session,
                                              const HardwareSurroundings& surroundings) {
  const description::SensorPlacement& sensor = session.cell.sensor;
  if (!sensor.on_udp() || !session.sensor.described || !session.sensor.described->datagrams) return {};
  const fieldbus::UdpPeer peer = fieldbus::peer_of(sensor, session.sensor);
  if (surroundings.is_udp_here(peer)) return {};
  return {peer};
}

void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces, const HardwareSurroundings& surroundings) {
  std::vector<std::string> real = real_interfaces(interfaces, surroundings);
  const std::vector<description::ModbusLineDescription> lines = real_lines(session.cell, surroundings);
  const std::vector<fieldbus::UdpPeer> udp = real_udp_peers(session, surroundings);
  if (!options.hardware.empty() && options.hardware != "ask" && options.hardware != confirmation) {
    throw SetupError({.key = "--hardware",
                      .found = description::in_quotes(options.hardware),
                      .expected = "--hardware, or for scripts --hardware=checked"});
  }
  if (real.empty() && lines.empty() && udp.empty()) return;
  if (options.hardware.empty()) refuse(real, lines, udp);
  require_enabling_input(session);
  if (!options.without_proof) require_proof(session);
  for (const description::ModbusLineDescription& line : lines) real.push_back(fieldbus::peer_text(line));
  for (const fieldbus::UdpPeer& peer : udp) real.push_back(fieldbus::peer_text(peer));
  print_checklist(session, real, !lines.empty(), surroundings.out);
  if (options.hardware == confirmation) return;
  if (!surroundings.on_terminal) {
    throw SetupError({.key = "--hardware",
                      .found = "no terminal to confirm on",
                      .expected = "somebody who types '" + std::string(confirmation) + "'",
                      .advice = "in a script, after the checks: --hardware=checked"});
  }
  surroundings.out << "Type '" << confirmation << "' if all of this holds: " << std::flush;
  std::string answer;
  std::getline(surroundings.in, answer);
  if (answer == confirmation) return;
  throw SetupError({.key = "--hardware",
                    .found = description::in_quotes(answer.substr(0, 40)),
                    .expected = description::in_quotes(confirmation)});
}

namespace {

HardwareSurroundings surroundings_here() {
  const char* const named = std::getenv("PROXARM_TREAT_AS_REAL");
  const std::string taken = named == nullptr ? "" : "," + std::string(named) + ",";
  const auto is_taken = [taken](const std::string& name) { return taken.find("," + name + ",") != std::string::npos; };
  return {[=](const std::string& interface) { return !is_taken(interface) && fieldbus::is_virtual_can(interface); },
          [=](const description::ModbusLineDescription& line) {
            return !is_taken(line.serial() ? line.device : line.host) && fieldbus::is_on_this_machine(line);
          },
          [=](const fieldbus::UdpPeer& peer) { return !is_taken(peer.host) && fieldbus::is_on_this_machine(peer); },
          isatty(STDIN_FILENO) != 0 && isatty(STDERR_FILENO) != 0,
          std::cin,
          std::cerr};
}

}  // namespace

void require_hardware_consent(const PreparedSession& session, const RunOptions& options,
                              const std::vector<std::string>& interfaces) {
  require_hardware_consent(session, options, interfaces, surroundings_here());
}

bool is_real(const PreparedSession& session, const std::vector<std::string>& interfaces) {
  const HardwareSurroundings surroundings = surroundings_here();
  return !real_interfaces(interfaces, surroundings).empty() || !real_lines(session.cell, surroundings).empty() ||
         !real_udp_peers(session, surroundings).empty();
}

}  // namespace proxarm::controller
