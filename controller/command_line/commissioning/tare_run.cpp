#include "controller/command_line/commissioning/tare_run.hpp"

#include "controller/command_line/commissioning/arm_at_hand.hpp"
#include "controller/command_line/live/hardware_consent.hpp"
#include "controller/command_line/live/realtime.hpp"
#include "controller/command_line/live/signal_watch.hpp"
#include "controller/command_line/sessions/zero_run.hpp"
#include "controller/session/session.hpp"

namespace proxarm::command_line {
namespace {

using controller::Cycle;

constexpr std::size_t record_capacity = 64;
// A duration that no session reaches, because the session ends when the sensor is tared, or by a fault.
constexpr double never_s = 86400.0;

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

ZeroOutcome tare_simulated(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options) {
  SimulatedArm simulated(arm, options);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  Cycle cycle(simulated.brought_up(session, scene), session.settings, session.cell.limits, record_capacity);
  return tared(session, cycle, simulated.network, false);
}

ZeroOutcome tare_on_interfaces(const PreparedSession& session, const RunOptions& options) {
  ArmOnInterfaces arm(session, options);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  Cycle cycle(arm.brought_up(session, scene), session.settings, session.cell.limits, record_capacity);
  SignalWatch signals([&] { cycle.request_stop(); });
  const RealtimeThread realtime;
  return tared(session, cycle, arm.network, is_real(session, arm.interfaces));
}

}  // namespace proxarm::command_line
