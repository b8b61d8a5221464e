#include <atomic>
#include <cstdio>
#include <memory>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/sim_view.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/start_check.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "fieldbus/canopen/bus_leader.hpp"
#include "fieldbus/udp/udp_port.hpp"
#include "models/base/setup_error.hpp"
#include "sim/cell/far_end_process.hpp"
#include "sim/devices/modbus_server.hpp"
#include "sim/devices/udp_server.hpp"

namespace proxarm::command_line {

namespace {

// Returns the hand at the handle. For a proof, returns a hand without force, because a helper pushes as the proof asks
// instead.
description::HandDescription hand_of(const controller::PreparedSession& session,
                                     const controller::RunOptions& options) {
  if (!options.for_proof) return session.hand;
  if (!options.hand.empty()) {
    throw description::SetupError({.key = "--for-proof",
                                   .found = "--hand beside it",
                                   .expected = "one of the two",
                                   .advice = "the hand plays its own motion, whatever a proof asks for"});
  }
  description::HandDescription nobody;
  nobody.mass_kg = nobody.stiffness_N_per_m = nobody.damping_Ns_per_m = 0.0;
  return nobody;
}

// Throws SetupError if a device with the node number of a simulated drive is already on the drive's bus: both devices
// would answer a request to that node.
void require_nobody_plays(const description::Cell& cell, fieldbus::CanNetwork& network,
                          const std::vector<std::size_t>& interface_of_bus) {
  std::vector<fieldbus::BusToLead> buses;
  for (std::size_t i = 0; i < cell.buses.size(); ++i) {
    fieldbus::BusToLead bus{.bus = interface_of_bus[i]};
    for (const description::DriveDescription& drive : cell.drives) {
      if (drive.on_can() && drive.bus == cell.buses[i].name) bus.nodes.push_back(drive.node);
    }
    buses.push_back(std::move(bus));
  }
  fieldbus::require_nobody_plays(network, buses);
}

}  // namespace

// Runs until a signal comes, or until the reader of the output is gone.
int sim_command(const controller::RunOptions& options) {
  if (options.bus.simulated()) {
    throw description::SetupError({.key = "--bus",
                                   .found = "sim",
                                   .expected = "the CAN interfaces on which the simulated arm answers",
                                   .advice = "for both in one process: proxarm run"});
  }
  const controller::PreparedSession session = controller::prepare(options);
  const description::HandDescription hand = hand_of(session, options);
  controller::require_enabling_switch(session, options);
  controller::require_view(options);
  std::unique_ptr<SimView> view;
  if (options.view) view = std::make_unique<SimView>(session, options);
  std::atomic<bool> stop{false};
  const std::vector<std::string> interfaces = options.bus.interfaces(controller::bus_names(session.cell));
  controller::require_nodes_apart(session, interfaces);
  fieldbus::SocketCanNetwork network(interfaces, {.closed = true});
  controller::require_fd(session.cell, network);
  std::vector<std::size_t> interface_of_bus;
  for (std::size_t i = 0; i < interfaces.size(); ++i) interface_of_bus.push_back(network.bus_of(i));
  sim::set_acceptance_filters(network, session.cell, session.sensor, interface_of_bus);
  require_nobody_plays(session.cell, network, interface_of_bus);
  sim::SimulatedCellConfig config;
  config.faults = options.faults;
  config.enabling = options.enabling;
  config.helps_to_prove = options.for_proof;
  std::unique_ptr<sim::UdpServer> sensor_server;  // before `process`, whose cell it must outlive
  sim::FarEndProcess process(session.cell, session.sensor, hand, network, interface_of_bus, config);
  std::vector<std::unique_ptr<sim::ModbusServer>> servers;
  for (const description::ModbusLineDescription& line : session.cell.modbus_lines) {
    servers.push_back(std::make_unique<sim::ModbusServer>(line, process.cell().modbus_devices(line.name)));
  }
  if (session.cell.sensor.on_udp()) {  // FarEndProcess has refused a sensor that isn't on UDP
    const fieldbus::UdpPeer own = fieldbus::peer_of(session.cell.sensor, session.sensor);
    sensor_server = std::make_unique<sim::UdpServer>(own.host, own.port);
    process.cell().connect_sensor(*sensor_server);
  }
  if (view) view->watch(process.cell());
  controller::SignalWatch signals([&] { stop.store(true); });
  std::fprintf(stderr, "proxarm sim: %s on the wire; Ctrl-C ends it\n", session.cell.name.c_str());
  process.run(stop);
  const sim::FarEndStatistics statistics = process.statistics();
  std::fprintf(
      stderr,
      "proxarm sim: %llu frames received, %llu sent, %llu lost, %llu not sent; %llu late wake-ups, the latest by "
      "%.3g ms\n",
      static_cast<unsigned long long>(statistics.frames_received),
      static_cast<unsigned long long>(statistics.frames_sent), static_cast<unsigned long long>(statistics.frames_lost),
      static_cast<unsigned long long>(statistics.frames_not_sent),
      static_cast<unsigned long long>(statistics.late_wake_ups),
      1e-6 * static_cast<double>(statistics.latest_wake_up_ns));
  return 0;
}

}  // namespace proxarm::command_line
