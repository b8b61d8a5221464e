#include "controller/command_line/sessions/zero_run.hpp"

#include <cmath>
#include <cstdio>

#include "controller/command_line/live/hardware_consent.hpp"
#include "controller/command_line/live/realtime.hpp"
#include "controller/command_line/live/signal_watch.hpp"
#include "controller/command_line/preparation/cell_buses.hpp"
#include "controller/command_line/preparation/proof_file.hpp"
#include "controller/command_line/preparation/start_check.hpp"
#include "controller/command_line/sessions/interface_network.hpp"
#include "controller/library/simulated_loop.hpp"
#include "controller/session/bring_up.hpp"
#include "controller/session/session.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/base/setup_error.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {
namespace {

using controller::Cycle;

constexpr std::size_t record_capacity = 64;
// It ends by itself once the sensor is tared, or by a fault.
constexpr double never_s = 86400.0;

ZeroFile zero_of(const PreparedSession& session, const Cycle& cycle, bool real_arm) {
  const controller::Measurement& measurement = cycle.measurement();
  const models::Wrench& bias_S = measurement.compensation().bias_S();
  const models::JointVector& motor_rad = measurement.now().motor_rad;
  return {.cell_sha256 = cell_sha256(session),
          .real_arm = real_arm,
          .date = today(),
          .force_S_N = {bias_S.force.x(), bias_S.force.y(), bias_S.force.z()},
          .torque_S_Nm = {bias_S.torque.x(), bias_S.torque.y(), bias_S.torque.z()},
          .noise_N = measurement.now().bias.noise_N,
          .spread_N = measurement.tare_spread_N(),
          .motor_rad = {motor_rad.data(), motor_rad.data() + motor_rad.size()}};
}

ZeroOutcome tared(const PreparedSession& session, Cycle& cycle, fieldbus::CanNetwork& network, bool real_arm) {
  controller::CycleRecord record;
  const controller::SessionHooks hooks{{}, [&] {
                                         while (cycle.records().pop(record)) continue;
                                       }};
  controller::run_session(cycle, network, {never_s}, hooks);
  cycle.shut_down();
  const controller::FaultReport& fault = cycle.supervisor().report();
  const bool complete = fault.fault == controller::Fault::none && cycle.measurement().now().bias.samples > 0.0;
  return {.fault = fault, .complete = complete, .zero = zero_of(session, cycle, real_arm)};
}

}  // namespace

void know_zero(PreparedSession& session, const RunOptions& options) {
  const bool real = !options.bus.simulated() && is_real(session, options.bus.interfaces(bus_names(session.cell)));
  const std::optional<ZeroFile> kept = kept_zero(session, real);
  if (kept) {
    session.settings.zero_S_N = kept->force_S_N;
  } else if (real) {
    session.settings.zero_S_N = {};
  }
}

void keep_zero(const PreparedSession& session, const RunOptions& options, const std::vector<std::string>& interfaces,
               const Cycle& cycle) {
  const bool accepted = std::isfinite(options.settings.zero_drift_N);
  if (accepted || cycle.supervisor().faulted() || cycle.rendered_cycles() == 0 || !is_real(session, interfaces)) return;
  try {
    write_zero(zero_path(session.cell), zero_of(session, cycle, true));
  } catch (const description::SetupError& error) {
    std::fprintf(stderr, "proxarm: warning: %s\n", error.what());
  }
}

ZeroOutcome tare_simulated(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options) {
  fieldbus::SimulatedCanNetwork network(sim::simulated_buses(arm.cell));
  description::HandDescription nobody;
  nobody.mass_kg = nobody.stiffness_N_per_m = nobody.damping_Ns_per_m = 0.0;
  sim::SimulatedCellConfig config;
  config.faults = options.faults;
  config.enabling = options.enabling;
  sim::SimulatedCell far_end(arm.cell, arm.sensor, nobody, network.events(), config);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  const controller::ModbusOpener open_line = [&](const description::ModbusLineDescription& line, double) {
    return far_end.modbus_client(line.name);
  };
  controller::CycleParts parts = controller::build_parts(session.cell, session.sensor, scene, session.settings, network,
                                                         buses_in_order(session.cell), open_line);
  far_end.attach_to(network);
  far_end.power_on();
  controller::bring_up(parts, [&](fieldbus::ModbusLine& line) { controller::pump(network, line, network.now_ns()); });
  Cycle cycle(std::move(parts), session.settings, session.cell.limits, record_capacity);
  return tared(session, cycle, network, false);
}

ZeroOutcome tare_on_interfaces(const PreparedSession& session, const RunOptions& options) {
  const std::vector<std::string> interfaces = options.bus.interfaces(bus_names(session.cell));
  require_nodes_apart(session, interfaces);
  fieldbus::SocketCanNetwork network = open_network(interfaces);
  require_hardware_consent(session, options, interfaces);
  require_fd(session.cell, network);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  controller::CycleParts parts = controller::build_parts(session.cell, session.sensor, scene, session.settings, network,
                                                         indices_in(network, interfaces.size()),
                                                         controller::opener_of(fieldbus::ModbusPeers::any));
  set_filters(network, parts);
  bring_up_devices(parts);
  Cycle cycle(std::move(parts), session.settings, session.cell.limits, record_capacity);
  SignalWatch signals([&] { cycle.request_stop(); });
  const RealtimeThread realtime;
  return tared(session, cycle, network, is_real(session, interfaces));
}

}  // namespace proxarm::command_line
