#include <cstdio>

#include "controller/command_line/commands.hpp"
#include "fieldbus/bus_scan.hpp"
#include "fieldbus/socket_can_network.hpp"

namespace proxarm::command_line {

int scan_command(const ScanOptions& options) {
  fieldbus::SocketCanNetwork network({options.interface});
  fieldbus::ScanSettings settings;
  settings.sensor_base_id = options.sensor_base_id;
  std::printf("%s: listening for a second ...\n", options.interface.c_str());
  std::fflush(stdout);
  const fieldbus::ScanResult result = fieldbus::scan_bus(network, 0, settings);
  std::printf("%s", fieldbus::scan_text(result, settings).c_str());
  const bool found = !result.nodes.empty() || result.sensor_gauges.has_value();
  return found ? 0 : 1;
}

}  // namespace proxarm::command_line
