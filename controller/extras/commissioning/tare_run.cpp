#include "controller/extras/commissioning/tare_run.hpp"

#include "controller/command_line/sessions/zero_run.hpp"
#include "controller/extras/commissioning/arm_at_hand.hpp"
#include "controller/live/hardware_consent.hpp"
#include "controller/live/realtime.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/session/session.hpp"

namespace proxarm::command_line {
namespace {

using controller::Cycle;

constexpr std::size_t record_capacity = 64;
// A duration that no session reaches, because the session ends when the sensor is tared, or by a fault.
constexpr double never_s = 86400.0;

ZeroOutcome tared(const controller::PreparedSession& session, Cycle& cycle, fieldbus::CanNetwork& network,
                  bool real_arm) {
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

ZeroOutcome tare_simulated(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                           const controller::RunOptions& options) {
  SimulatedArm simulated(arm, options);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  Cycle cycle(simulated.brought_up(session, scene), session.settings, session.cell.limits, record_capacity);
  return tared(session, cycle, simulated.network, false);
}

ZeroOutcome tare_on_interfaces(const controller::PreparedSession& session, const controller::RunOptions& options) {
  ArmOnInterfaces arm(session, options);
  scenes::CompiledScene scene = scenes::compile(session.scene);
  Cycle cycle(arm.brought_up(session, scene), session.settings, session.cell.limits, record_capacity);
  controller::SignalWatch signals([&] { cycle.request_stop(); });
  const controller::RealtimeThread realtime;
  return tared(session, cycle, arm.network, controller::is_real(session, arm.interfaces));
}

}  // namespace proxarm::command_line
