#include "controller/command_line/sessions/interface_run.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <thread>

#include "controller/command_line/sessions/interface_network.hpp"
#include "controller/command_line/sessions/session_output.hpp"
#include "controller/command_line/sessions/zero_run.hpp"
#include "controller/library/black_box_files.hpp"
#include "controller/library/recorded_messages.hpp"
#include "controller/library/session_summary.hpp"
#include "controller/live/hardware_consent.hpp"
#include "controller/live/live_parameters.hpp"
#include "controller/live/realtime.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/modbus_rates.hpp"
#include "controller/preparation/start_check.hpp"
#include "controller/record/frame_tap.hpp"
#include "controller/report/latency.hpp"
#include "controller/session/bring_up.hpp"
#include "controller/session/session.hpp"
#include "fieldbus/can/can_timing.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using controller::Cycle;
using controller::CycleRecord;
using fieldbus::SocketCanNetwork;
using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t record_capacity = 8192;  // 8 s at 1 kHz, in case the disk blocks for that long
constexpr std::size_t frame_capacity = 262144;
constexpr auto drain_interval = std::chrono::milliseconds(5);

std::vector<std::string> names_in(fieldbus::CanNetwork& network) {
  std::vector<std::string> names;
  for (std::size_t bus = 0; bus < network.bus_count(); ++bus) names.push_back(network.bus(bus).name());
  return names;
}

// Returns the bitrates of each bus of the network: those of the slowest of the cell's buses that share the interface.
std::vector<fieldbus::BitRates> bit_rates(const description::Cell& cell, const controller::BusIndices& indices) {
  const std::size_t buses = indices.empty() ? 0 : *std::max_element(indices.begin(), indices.end()) + 1;
  std::vector<fieldbus::BitRates> rates(buses, {0, 0});
  for (std::size_t i = 0; i < indices.size(); ++i) {
    fieldbus::BitRates& shared = rates[indices[i]];
    if (shared.nominal == 0 || cell.buses[i].bitrate < shared.nominal) {
      shared = {cell.buses[i].bitrate, cell.buses[i].data_bitrate};
    }
  }
  return rates;
}

// Takes records and frames out of the cycle's rings in a separate thread, and passes them on to the output. It also
// counts how long the frames would occupy a bus with the cell's bitrates, because on a virtual interface frames take no
// time.
class Drain {
 public:
  Drain(controller::SpscRing<CycleRecord>& records, controller::FrameTap& tap, SessionOutput& output,
        std::vector<fieldbus::BitRates> rates, BlackBoxKeeper& keeper, controller::LatencyMeter& meter,
        controller::ReplayRecorder* replay, controller::RecordedMessages* messages, std::function<void()> on_failure)
      : records_(records),
        tap_(tap),
        output_(output),
        rates_(std::move(rates)),
        keeper_(keeper),
        meter_(meter),
        replay_(replay),
        messages_(messages),
        on_failure_(std::move(on_failure)),
        busy_ns_(rates_.size()),
        begun_ns_(tap.now_ns()),
        thread_([this] { loop(); }) {}
  Drain(const Drain&) = delete;
  Drain& operator=(const Drain&) = delete;
  ~Drain() { join(); }

  // Ends the thread and drains the rings. If an exception had stopped the thread, throws that exception.
  void finish() {
    join();
    if (failure_) std::rethrow_exception(failure_);
    drain();
  }

  // Returns the load of each interface by its name. Call this function after finish().
  [[nodiscard]] std::map<std::string, double> loads() const {
    std::map<std::string, double> loads;
    for (std::size_t bus = 0; bus < busy_ns_.size() && last_ns_ > begun_ns_; ++bus) {
      loads[tap_.bus(bus).name()] = static_cast<double>(busy_ns_[bus]) / static_cast<double>(last_ns_ - begun_ns_);
    }
    return loads;
  }

 private:
  void join() {
    if (!thread_.joinable()) return;
    ended_.store(true, std::memory_order_release);
    thread_.join();
  }
  // Drains the rings until the session ends. An exception must not leave this thread while the arm moves, so it is
  // kept, and the session makes a controlled stop first.
  void loop() {
    try {
      while (!ended_.load(std::memory_order_acquire)) {
        drain();
        std::this_thread::sleep_for(drain_interval);
      }
    } catch (...) {
      failure_ = std::current_exception();
      on_failure_();
    }
  }
  void drain() {
    CycleRecord record;
    while (records_.pop(record)) {
      const CycleRecord completed = output_.add(record);
      if (messages_ != nullptr) messages_->add(completed);
    }
    meter_.drain();
    if (replay_ != nullptr) replay_->drain(keeper_.head());
    if (messages_ != nullptr) messages_->drain(keeper_.box());
    controller::TappedFrame tapped;
    while (tap_.frames().pop(tapped)) {
      output_.add_frame(tap_.bus(tapped.bus).name(), tapped.frame, tapped.time_ns);
      if (tapped.time_ns < begun_ns_) continue;
      busy_ns_[tapped.bus] += fieldbus::wire_time_ns(tapped.frame, rates_[tapped.bus]);
      last_ns_ = std::max(last_ns_, tapped.time_ns);
    }
  }

  controller::SpscRing<CycleRecord>& records_;
  controller::FrameTap& tap_;
  SessionOutput& output_;
  std::vector<fieldbus::BitRates> rates_;
  BlackBoxKeeper& keeper_;
  controller::LatencyMeter& meter_;
  controller::ReplayRecorder* replay_;
  controller::RecordedMessages* messages_;
  std::function<void()> on_failure_;
  std::exception_ptr failure_;  // set by the thread, and read after the thread has ended
  std::vector<std::int64_t> busy_ns_;
  std::int64_t begun_ns_;
  std::int64_t last_ns_ = 0;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace

int run_on_interfaces(const controller::PreparedSession& session, const controller::RunOptions& options,
                      BlackBoxKeeper& keeper) {
  const std::vector<std::string> interfaces = options.bus.interfaces(controller::bus_names(session.cell));
  controller::require_nodes_apart(session, interfaces);
  SocketCanNetwork network = open_network(interfaces);
  controller::require_carried_on(interfaces, session, options);
  controller::require_hardware_consent(session, options, interfaces);
  controller::require_fd(session.cell, network);
  const controller::BusIndices indices = indices_in(network, interfaces.size());

  scenes::CompiledScene scene = scenes::compile(session.scene);
  controller::FrameTap tap(network, frame_capacity);
  // Any Modbus or UDP peer is allowed, because require_hardware_consent() was called above.
  controller::CycleParts parts = controller::build_parts(session.cell, session.sensor, scene, session.settings, tap,
                                                         indices, controller::opener_of(fieldbus::ModbusPeers::any),
                                                         controller::opener_of(fieldbus::UdpPeers::any));
  SessionOutput output(session, options, false);
  std::unique_ptr<controller::ReplayRecorder> replay;
  std::unique_ptr<controller::RecordedMessages> messages;
  if (!options.record_dir.empty()) {
    replay = std::make_unique<controller::ReplayRecorder>(keeper.box(), options.record_dir,
                                                          controller::replay_files(session));
    messages = std::make_unique<controller::RecordedMessages>(options.record_dir, session);
  }
  keeper.set_head(controller::replay_head(session, names_in(tap), indices));
  bring_up_devices(network, parts);
  controller::report_modbus_rates(session, parts);

  Cycle cycle(std::move(parts), session.settings, session.cell.limits, record_capacity);
  cycle.write_to(keeper.box());
  controller::SignalWatch signals([&] { cycle.request_stop(); });
  output.introduce();
  controller::schedule_changes(cycle, session, options);
  const std::unique_ptr<controller::ControlSocket> control =
      controller::control_socket(options, controller::control_handlers(cycle, session, options, keeper.box()));
  controller::LatencyMeter meter(keeper.box(), cycle.parts().sensor_bus, cycle.parts().sensor->wanted_ids());
  Drain drain(cycle.records(), tap, output, bit_rates(session.cell, indices), keeper, meter, replay.get(),
              messages.get(), [&] { cycle.request_stop(); });
  const SteadyClock::time_point begun = SteadyClock::now();
  controller::SessionTally tally;
  {
    const controller::RealtimeThread realtime;
    tally = controller::run_session(cycle, tap, controller::session_length(session, options), {});
    cycle.shut_down();
  }
  const double wall_s = std::chrono::duration<double>(SteadyClock::now() - begun).count();
  drain.finish();
  if (replay) replay->finish();
  if (messages) messages->finish();

  keep_zero(session, options, interfaces, cycle);
  controller::Summary summary = output.summary(cycle, tally.end, signals.cause());
  summary.wall_time_s = wall_s;
  summary.overruns = tally.overruns;
  summary.page_faults = tally.page_faults;
  summary.latency_us = {{"wake_up", controller::latency_summary(meter.latencies().wake_up)},
                        {"compute", controller::latency_summary(meter.latencies().compute)},
                        {"sensor_to_setpoint", controller::latency_summary(meter.latencies().sensor_to_setpoint)}};
  summary.bus_load = drain.loads();
  return output.finish(summary, keeper);
}

}  // namespace proxarm::command_line
