#include "controller/extras/commissioning/arm_at_hand.hpp"

#include "controller/command_line/sessions/interface_network.hpp"
#include "controller/library/simulated_loop.hpp"
#include "controller/live/hardware_consent.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/start_check.hpp"
#include "controller/session/bring_up.hpp"

namespace proxarm::command_line {
namespace {

std::vector<std::string> apart(const controller::PreparedSession& session, const controller::RunOptions& options) {
  std::vector<std::string> interfaces = options.bus.interfaces(controller::bus_names(session.cell));
  controller::require_nodes_apart(session, interfaces);
  return interfaces;
}

}  // namespace

description::HandDescription nobody() {
  description::HandDescription hand;
  hand.mass_kg = hand.stiffness_N_per_m = hand.damping_Ns_per_m = 0.0;
  return hand;
}

SimulatedArm::SimulatedArm(const controller::PreparedSession& arm, const controller::RunOptions& options,
                           const description::HandDescription& hand)
    : network(sim::simulated_buses(arm.cell)),
      far_end(arm.cell, arm.sensor, hand, network.events(),
              {.plant = {}, .faults = options.faults, .enabling = options.enabling}) {}

void SimulatedArm::power_on() {
  far_end.attach_to(network);
  far_end.power_on();
}

controller::CycleParts SimulatedArm::brought_up(const controller::PreparedSession& session,
                                                scenes::CompiledScene& scene) {
  const controller::ModbusOpener open_line = [&](const description::ModbusLineDescription& line, double) {
    return far_end.modbus_client(line.name);
  };
  controller::CycleParts parts = controller::build_parts(session.cell, session.sensor, scene, session.settings, network,
                                                         controller::buses_in_order(session.cell), open_line,
                                                         [&](const auto&) { return far_end.datagram_port(); });
  power_on();
  controller::bring_up(parts, [&](fieldbus::ModbusLine& line) { controller::pump(network, line, network.now_ns()); });
  return parts;
}

ArmOnInterfaces::ArmOnInterfaces(const controller::PreparedSession& session, const controller::RunOptions& options)
    : interfaces(apart(session, options)), network(open_network(interfaces)) {
  controller::require_hardware_consent(session, options, interfaces);
  controller::require_fd(session.cell, network);
}

controller::CycleParts ArmOnInterfaces::brought_up(const controller::PreparedSession& session,
                                                   scenes::CompiledScene& scene) {
  controller::CycleParts parts = controller::build_parts(
      session.cell, session.sensor, scene, session.settings, network, indices_in(network, interfaces.size()),
      controller::opener_of(fieldbus::ModbusPeers::any), controller::opener_of(fieldbus::UdpPeers::any));
  bring_up_devices(network, parts);
  return parts;
}

}  // namespace proxarm::command_line
