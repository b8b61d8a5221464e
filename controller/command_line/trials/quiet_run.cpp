#include "controller/command_line/trials/quiet_run.hpp"

#include <cmath>

#include "controller/command_line/preparation/cell_buses.hpp"
#include "controller/session/bring_up.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::command_line {
namespace {

// A Modbus line's worker on the virtual clock: an exchange takes as long as it does on the wire.
void pump(fieldbus::SimulatedCanNetwork& network, fieldbus::ModbusLine& line, std::int64_t time_ns) {
  const std::int64_t earliest_ns = time_ns + std::llround(1e9 * line.exchange_s());
  const std::int64_t next_ns = std::max<std::int64_t>(line.step(time_ns), earliest_ns);
  network.events().schedule(next_ns, [&network, &line](std::int64_t t_ns) { pump(network, line, t_ns); });
}

}  // namespace

QuietEnd run_quietly(const PreparedSession& session, const LookAtCycle& look) {
  fieldbus::SimulatedCanNetwork network(sim::simulated_buses(session.cell));
  sim::SimulatedCell far_end(session.cell, session.sensor, session.hand, network.events());
  scenes::CompiledScene scene = scenes::compile(session.scene);
  const auto open_line = [&](const description::ModbusLineDescription& line, double) {
    return far_end.modbus_client(line.name);
  };
  controller::CycleParts parts = controller::build_parts(session.cell, session.sensor, scene, session.settings, network,
                                                         buses_in_order(session.cell), open_line);
  far_end.attach_to(network);
  far_end.power_on();
  controller::bring_up(parts, [&](fieldbus::ModbusLine& line) { pump(network, line, network.now_ns()); });
  constexpr std::size_t drained_after_every_cycle = 64;
  controller::Cycle cycle(std::move(parts), session.settings, session.cell.limits, drained_after_every_cycle);
  sim::Truth truth;
  const controller::SessionHooks hooks{[&](std::int64_t) { truth = far_end.truth(); },
                                       [&] {
                                         controller::CycleRecord record;
                                         while (cycle.records().pop(record)) look(record, truth);
                                       }};
  QuietEnd out;
  out.end = controller::run_session(cycle, network, {session.duration_s}, hooks).end;
  if (cycle.supervisor().faulted()) out.fault = controller::fault_name(cycle.supervisor().report().fault);
  if (cycle.work() != nullptr) out.work = *cycle.work();
  cycle.shut_down();
  return out;
}

}  // namespace proxarm::command_line
