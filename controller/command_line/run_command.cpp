#include <chrono>
#include <cstdio>
#include <optional>

#include "controller/bring_up.hpp"
#include "controller/command_line/commands.hpp"
#include "controller/command_line/prepared_session.hpp"
#include "controller/command_line/session_output.hpp"
#include "controller/command_line/signal_watch.hpp"
#include "controller/session.hpp"
#include "fieldbus/simulated_can_network.hpp"
#include "models/description/setup_error.hpp"
#include "sim/simulated_cell.hpp"

namespace proxarm::command_line {
namespace {

using controller::Cycle;
using controller::CycleRecord;
using controller::Summary;
using SteadyClock = std::chrono::steady_clock;

constexpr int fault_ended_the_run = 1;
constexpr std::size_t record_capacity = 8192;

std::string place_of(const controller::FaultReport& report, const controller::CycleParts& parts) {
  using controller::Fault;
  if (report.where < 0) return "";
  const auto where = static_cast<std::size_t>(report.where);
  if (report.fault == Fault::bus_off || report.fault == Fault::receive_overflow) {
    return "bus " + parts.network.bus(where).name();
  }
  const fieldbus::ServoDrive& drive = parts.drives[where].drive;
  std::string place = "drive of " + drive.description().joint + ", bus " + drive.description().bus + ", node " +
                      std::to_string(drive.node());
  if (report.fault == Fault::drive_fault || report.fault == Fault::drive_disabled) place += ": " + drive.describe();
  return place;
}

void add_faults(Summary& summary, const Cycle& cycle) {
  const controller::FaultReport& report = cycle.supervisor().report();
  if (report.fault == controller::Fault::none) return;
  summary.faults.push_back({report.fault, report.cycle, describe(report, place_of(report, cycle.parts()))});
}

// What the user should know before the arm moves; standard output stays the summary's with --json.
void introduce(const PreparedSession& session, const controller::CycleParts& parts, const RunOptions& options) {
  if (options.json) return;
  const models::TipMass tip = parts.arm->effective_mass_range(parts.arm->start_rad());
  std::printf("%s, scene %s: %.4g kg felt, T = %.4g ms, loop delay %.3g ms\n", session.cell.name.c_str(),
              session.scene.name.c_str(), session.settings.mass_kg, 1e3 * session.settings.period_s,
              1e3 * total_delay_s(session));
  std::printf("the arm itself, without control: %.0f to %.0f kg at the tip, first mode %.1f Hz\n", tip.min_kg,
              tip.max_kg, parts.arm->first_elastic_frequency_Hz(parts.arm->start_rad()));
}

std::vector<fieldbus::SimulatedBusConfig> simulated_buses(const description::Cell& cell) {
  std::vector<fieldbus::SimulatedBusConfig> buses;
  for (const description::BusDescription& bus : cell.buses) {
    fieldbus::SimulatedBusConfig config;
    config.name = bus.name;
    config.bitrate = bus.bitrate;
    config.data_bitrate = bus.data_bitrate;
    buses.push_back(config);
  }
  return buses;
}

controller::BusIndices one_to_one(std::size_t buses) {
  controller::BusIndices indices(buses);
  for (std::size_t i = 0; i < buses; ++i) indices[i] = i;
  return indices;
}

// Controller and simulated arm in one process, on in-process buses: `--bus sim`.
class SimulatedRun {
 public:
  SimulatedRun(const PreparedSession& session, const RunOptions& options)
      : session_(session),
        options_(options),
        network_(simulated_buses(session.cell)),
        far_end_(session.cell, session.sensor, session.hand, network_.events()),
        scene_(scenes::compile(session.scene)),
        output_(session, options, true) {}

  int run() {
    controller::CycleParts parts = controller::build_parts(session_.cell, session_.sensor, scene_, session_.settings,
                                                           network_, one_to_one(session_.cell.buses.size()));
    introduce(session_, parts, options_);
    if (!options_.record_dir.empty()) {
      network_.set_observer(
          [this](const fieldbus::WireFrame& wire) { output_.add_frame(wire.bus_name, wire.frame, wire.end_ns); });
    }
    far_end_.attach_to(network_);
    far_end_.power_on();
    controller::bring_up(parts);
    if (options_.pace == Pace::realtime) network_.follow_real_time();
    return run_cycles(std::move(parts));
  }

 private:
  int run_cycles(controller::CycleParts parts) {
    Cycle cycle(std::move(parts), session_.settings, session_.cell.limits, record_capacity);
    SignalWatch signals([&](int) { cycle.request_stop(); });
    const SteadyClock::time_point begun = SteadyClock::now();
    const controller::SessionTally tally =
        controller::run_session(cycle, network_, session_.settings.period_s, session_.duration_s,
                                {[this](std::int64_t) { truth_ = far_end_.truth(); }, [&] { drain(cycle.records()); }});
    const double wall_s = std::chrono::duration<double>(SteadyClock::now() - begun).count();

    Summary summary = output_.summary();
    summary.wall_time_s = wall_s;
    summary.overruns = tally.overruns;
    for (std::size_t i = 0; i < network_.bus_count(); ++i) {
      summary.bus_load[network_.bus(i).name()] = network_.simulated_bus(i).load();
    }
    add_faults(summary, cycle);
    output_.finish(summary);
    return summary.faults.empty() ? 0 : fault_ended_the_run;
  }

  void drain(controller::SpscRing<CycleRecord>& records) {
    CycleRecord record;
    while (records.pop(record)) {
      record.set(controller::RecordFlag::truth);
      record.true_tool_W_m = controller::triple(truth_.X_WT.translation());
      record.hand_force_W_N = controller::triple(truth_.hand_force_W);
      output_.add(record);
    }
  }

  const PreparedSession& session_;
  const RunOptions& options_;
  fieldbus::SimulatedCanNetwork network_;
  sim::SimulatedCell far_end_;
  scenes::CompiledScene scene_;
  SessionOutput output_;
  sim::Truth truth_;
};

}  // namespace

int run_command(const RunOptions& options) {
  const PreparedSession session = prepare(options);
  require_stable(session, options);
  return SimulatedRun(session, options).run();
}

}  // namespace proxarm::command_line
