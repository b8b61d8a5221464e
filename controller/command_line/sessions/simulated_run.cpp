#include "controller/command_line/sessions/simulated_run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <thread>

#include "controller/command_line/live/live_parameters.hpp"
#include "controller/command_line/live/signal_watch.hpp"
#include "controller/command_line/preparation/cell_buses.hpp"
#include "controller/command_line/preparation/modbus_rates.hpp"
#include "controller/library/simulated_loop.hpp"
#include "controller/report/latency.hpp"
#include "controller/session/session.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using controller::Cycle;
using controller::CycleRecord;
using SteadyClock = std::chrono::steady_clock;

// Makes virtual time keep pace with the wall clock, for viewers: each cycle waits until its time has come on the wall
// clock. No cycle is skipped, and the setpoints are equal to the bit to those of a run without waiting.
class Spectator {
 public:
  explicit Spectator(bool looks) : looks_(looks) {}
  void wait_for(std::int64_t t_k_ns) {
    if (!looks_) return;
    if (!first_ns_) {
      first_ns_ = t_k_ns;
      begun_ = SteadyClock::now();
    }
    std::this_thread::sleep_until(begun_ + std::chrono::nanoseconds(t_k_ns - *first_ns_));
  }

 private:
  bool looks_;
  std::optional<std::int64_t> first_ns_;
  SteadyClock::time_point begun_;
};

// Time that the last frames have to reach the drives. The longest queue of a cycle takes a millisecond.
constexpr std::int64_t last_words_ns = 5'000'000;
constexpr std::size_t record_capacity = 64;  // records are drained after every cycle

sim::SimulatedCellConfig far_end_config(const RunOptions& options) {
  sim::SimulatedCellConfig config;
  config.faults = options.faults;
  config.enabling = options.enabling;
  return config;
}

}  // namespace

SimulatedRun::SimulatedRun(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options,
                           BlackBoxKeeper& keeper)
    : session_(session),
      options_(options),
      keeper_(keeper),
      network_(sim::simulated_buses(arm.cell)),
      far_end_(arm.cell, arm.sensor, session.hand, network_.events(), far_end_config(options)),
      scene_(scenes::compile(session.scene)),
      output_(session, options, true) {}

int SimulatedRun::run() {
  keeper_.set_head(replay_head(session_, bus_names(session_.cell), buses_in_order(session_.cell)));
  const controller::ModbusOpener open_line = [this](const description::ModbusLineDescription& line, double) {
    return far_end_.modbus_client(line.name);
  };
  controller::CycleParts parts = controller::build_parts(session_.cell, session_.sensor, scene_, session_.settings,
                                                         network_, buses_in_order(session_.cell), open_line);
  if (!options_.record_dir.empty()) {
    network_.set_observer(
        [this](const fieldbus::WireFrame& wire) { output_.add_frame(wire.bus_name, wire.frame, wire.end_ns); });
    replay_ = std::make_unique<controller::ReplayRecorder>(keeper_.box(), options_.record_dir, replay_files(session_));
    messages_ = std::make_unique<RecordedMessages>(options_.record_dir, session_);
  }
  far_end_.attach_to(network_);
  far_end_.power_on();
  power_on_ns_ = network_.now_ns();
  controller::bring_up(parts,
                       [this](fieldbus::ModbusLine& line) { controller::pump(network_, line, network_.now_ns()); });
  report_modbus_rates(session_, parts);
  return run_cycles(std::move(parts));
}

int SimulatedRun::run_cycles(controller::CycleParts parts) {
  Cycle cycle(std::move(parts), session_.settings, session_.cell.limits, record_capacity);
  cycle.write_to(keeper_.box());
  SignalWatch signals([&] { cycle.request_stop(); });
  output_.introduce();
  const std::unique_ptr<ControlSocket> control = take_changes(cycle, session_, options_, keeper_.box());
  for (std::size_t i = 0; i < network_.bus_count(); ++i) {
    network_.simulated_bus(i).statistics().reset(network_.now_ns());
  }
  const SteadyClock::time_point begun = SteadyClock::now();
  controller::LatencyHistogram wake_up;
  std::optional<std::int64_t> first_cycle_ns;
  Spectator spectator(options_.view && !options_.pace);
  const controller::SessionHooks hooks{[&, this](std::int64_t t_k_ns) {
                                         spectator.wait_for(t_k_ns);
                                         if (!first_cycle_ns) first_cycle_ns = t_k_ns;
                                         wake_up.add(network_.woken_late_ns());
                                         truth_ = far_end_.truth();
                                         if (!exploded_at_ns_ && !controller::is_possible(truth_)) {
                                           exploded_at_ns_ = t_k_ns;
                                           cycle.request_stop();
                                         }
                                       },
                                       [&] { drain(cycle.records()); }};
  if (options_.pace == Pace::realtime) network_.follow_real_time();  // from now on, because no cycle ran before
  const controller::SessionTally tally =
      controller::run_session(cycle, network_, session_length(session_, options_), hooks);
  if (exploded_at_ns_) controller::refuse_explosion(1e-9 * static_cast<double>(*exploded_at_ns_ - power_on_ns_));
  const double wall_s = std::chrono::duration<double>(SteadyClock::now() - begun).count();
  controller::Summary summary = output_.summary(cycle, tally.end, signals.cause());
  summary.wall_time_s = wall_s;
  summary.overruns = tally.overruns;
  summary.virtual_time = options_.pace != Pace::realtime;
  if (first_cycle_ns) summary.first_cycle_s = 1e-9 * static_cast<double>(*first_cycle_ns - power_on_ns_);
  if (options_.pace == Pace::realtime) summary.latency_us["wake_up"] = controller::latency_summary(wake_up);
  for (std::size_t i = 0; i < network_.bus_count(); ++i) {
    summary.bus_load[network_.bus(i).name()] = network_.simulated_bus(i).load();
  }
  cycle.shut_down();
  network_.sleep_until(network_.now_ns() + last_words_ns);
  if (replay_) replay_->finish();
  if (messages_) messages_->finish();
  return output_.finish(summary, keeper_);
}

void SimulatedRun::drain(controller::SpscRing<CycleRecord>& records) {
  CycleRecord record;
  while (records.pop(record)) {
    controller::add_truth(record, truth_);
    keeper_.box().add_truth(record.true_tool_W_m, record.true_tool_q_W);
    const CycleRecord completed = output_.add(record);
    if (messages_) messages_->add(completed);
  }
  if (replay_) replay_->drain(keeper_.head());
  if (messages_) messages_->drain(keeper_.box());
}

}  // namespace proxarm::command_line
