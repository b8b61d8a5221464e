#include <cstdio>

#include "controller/command_line/commands.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "fieldbus/cia402/bus_scan.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

int scan_command(const ScanOptions& options) {
  if (options.interface == "sim") {
    throw description::SetupError({.key = "--bus",
                                   .found = "sim",
                                   .expected = "a CAN interface, such as can0 or vcan0",
                                   .advice = "to scan a simulated arm: proxarm sim --bus vcan0"});
  }
  fieldbus::SocketCanNetwork network({options.interface});
  fieldbus::ScanSettings settings;
  settings.sensor_base_id = options.sensor_base_id;
  std::printf("%s: listening for a second ...\n", options.interface.c_str());
  std::fflush(stdout);
  const fieldbus::ScanResult result = fieldbus::scan_bus(network, 0, settings);
  std::printf("%s", fieldbus::scan_text(result, settings).c_str());
  const bool found = !result.nodes.empty() || result.sensor_gauges.has_value();
  if (!found && result.heard.empty()) {
    // Whether nobody acknowledges what was sent. If no other device is on the bus, each attempt to send counts as an
    // error, until the interface is error passive.
    const bool unacknowledged = network.bus(0).status().state == fieldbus::BusState::error_passive;
    std::printf(
        "Nothing is heard and nothing answers%s: are the devices powered, is the bitrate theirs, are CAN_H and "
        "CAN_L connected, with 60 ohm between them?\n",
        unacknowledged ? ", and nobody acknowledges what is sent" : "");
  }
  return found ? 0 : 1;
}

}  // namespace proxarm::command_line
