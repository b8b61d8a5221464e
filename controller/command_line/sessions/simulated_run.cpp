#include "controller/command_line/sessions/simulated_run.hpp"

#include <chrono>
#include <optional>
#include <thread>

#include "controller/library/black_box_files.hpp"
#include "controller/library/paced_run.hpp"
#include "controller/live/live_parameters.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/modbus_rates.hpp"

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

}  // namespace

SimulatedRun::SimulatedRun(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                           const controller::RunOptions& options, BlackBoxKeeper& keeper)
    : session_(session),
      options_(options),
      keeper_(keeper),
      loop_(session, {}, {.arm = &arm, .faults = options.faults, .enabling = options.enabling}),
      output_(session, options, true) {}

int SimulatedRun::run() {
  keeper_.set_head(controller::replay_head(session_, controller::bus_names(session_.cell),
                                           controller::buses_in_order(session_.cell)));
  if (!options_.record_dir.empty()) keep_record();
  loop_.start();
  controller::report_modbus_rates(session_, loop_.cycle().parts());
  return run_cycles();
}

void SimulatedRun::keep_record() {
  loop_.network().set_observer(
      [this](const fieldbus::WireFrame& wire) { output_.add_frame(wire.bus_name, wire.frame, wire.end_ns); });
  replay_ = std::make_unique<controller::ReplayRecorder>(keeper_.box(), options_.record_dir,
                                                         controller::replay_files(session_));
  messages_ = std::make_unique<controller::RecordedMessages>(options_.record_dir, session_);
}

int SimulatedRun::run_cycles() {
  Cycle& cycle = loop_.cycle();
  cycle.write_to(keeper_.box());
  controller::SignalWatch signals([&] { cycle.request_stop(); });
  output_.introduce();
  controller::schedule_changes(cycle, session_, options_);
  const std::unique_ptr<controller::ControlSocket> control =
      controller::control_socket(options_, controller::control_handlers(cycle, session_, options_, keeper_.box()));
  Spectator spectator(options_.view && !options_.pace);
  const controller::PacedRun run = controller::run_at_pace(
      loop_, session_, options_, [this](const CycleRecord& record, const sim::Truth& truth) { drain(record, truth); },
      [&](std::int64_t t_k_ns) { spectator.wait_for(t_k_ns); });
  controller::Summary summary = output_.summary(cycle, run.tally.end, signals.cause());
  controller::add_figures(summary, run, loop_, options_);
  if (replay_) replay_->finish();
  if (messages_) messages_->finish();
  return output_.finish(summary, keeper_);
}

void SimulatedRun::drain(CycleRecord record, const sim::Truth& truth) {
  controller::add_truth(record, truth);
  keeper_.box().add_truth(record.true_tool_W_m, record.true_tool_q_W);
  const CycleRecord completed = output_.add(record);
  if (messages_) {
    messages_->add(completed);
    messages_->drain(keeper_.box());
  }
  if (replay_) replay_->drain(keeper_.head());
}

}  // namespace proxarm::command_line
