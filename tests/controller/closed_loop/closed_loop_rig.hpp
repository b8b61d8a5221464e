// The whole chain in one process for tests: default cell, touch of the wall, controller and simulated arm on three
// in-process buses, with whatever shall fail.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "controller/cycle/cycle.hpp"
#include "controller/session/bring_up.hpp"
#include "controller/session/reachable_scene.hpp"
#include "controller/session/session.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"
#include "sim/cell/simulated_cell.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller::testing {

struct RigOptions {
  std::vector<std::string> device_faults{};  // as on the command line
  fieldbus::FaultScript script{};
  double duration_s = 2.5;
  std::string cell = "models/cells/default.yaml";
  std::string scene = "scenes/wall.yaml";
  std::string hand = "sim/hands/touch.yaml";
  SessionSettings settings{};
  double sensor_delay_s = 0.0;
  std::array<double, models::max_axes>
      start_error_rad{};                       // by which the controller is wrong about where the arm stands
  std::array<double, 6> sensor_bias_counts{};  // added to the sensor's own
  std::vector<ScheduledChange> changes{};
  std::vector<ScheduledCommand> commands{};
  std::vector<ScheduledTimestep> timesteps{};
  std::vector<sim::PressedSpan> enabling{};               // of the cell's enabling switch, from the first SYNC
  std::function<void(description::Cell&)> edit_cell{};    // for both ends
  std::function<void(description::Cell&)> edit_belief{};  // the controller's alone
  std::function<void(description::HandDescription&)> edit_hand{};
  std::function<void(CycleParts&)> edit_parts{};                      // before the bring-up
  std::function<void(fieldbus::SimulatedCanNetwork&)> after_cycle{};  // such as to take a nap, and be late
  std::function<void(sim::SimulatedCell&)> before_goodbye{};          // which takes back what the drives wait for
  std::int64_t restart_ns = 0;                                        // of all buses, after bus-off by errors
  BlackBox* box = nullptr;
};

class ClosedLoopRig {
 public:
  explicit ClosedLoopRig(const RigOptions& rig)
      : options(rig),
        cell(edited(delayed(description::load_cell(source_file(rig.cell)), rig.sensor_delay_s), rig.edit_cell)),
        sensor(biased(description::load_sensor(source_file("models/sensors/ati_net_can_oem.yaml")), rig)),
        hand(edited(description::load_hand(source_file(rig.hand)), rig.edit_hand)),
        scene(reachable_scene(scenes::load_scene(source_file(rig.scene)), cell)),
        compiled(scenes::compile(scene)),
        network(buses_of(cell, rig)),
        far_end(cell, sensor, hand, network.events(), with_faults(rig)) {
    far_end.attach_to(network);
    network.apply(rig.script);
    far_end.power_on();
  }

  // Bring-up and the whole session. `through`: what the controller talks to, such as a recorder before the network.
  void run(fieldbus::CanNetwork& through) {
    cycle = std::make_unique<Cycle>(prepared_parts(through), options.settings, cell.limits, 64);
    const SessionHooks hooks{[this](std::int64_t t_k_ns) {
                               if (records.empty()) first_cycle_ns = t_k_ns;
                               truths.push_back(far_end.truth());
                             },
                             [this] {
                               drain();
                               if (options.after_cycle) options.after_cycle(network);
                             }};
    cycle->changes().schedule(options.changes);
    if (options.box != nullptr) cycle->write_to(*options.box);
    cycle->commands().schedule(options.commands);
    cycle->timesteps().schedule(options.timesteps);
    tally = run_session(*cycle, through, {options.duration_s}, hooks);
    if (options.before_goodbye) options.before_goodbye(far_end);
    cycle->shut_down();
    network.sleep_until(network.now_ns() + 1'500'000'000);  // the drives stop, and the gears ring out
  }
  void run() { run(network); }

  CycleParts prepared_parts(fieldbus::CanNetwork& through) {
    description::Cell believed = cell;
    for (std::size_t i = 0; i < cell.drives.size(); ++i) believed.start_rad[i] += options.start_error_rad[i];
    if (options.edit_belief) options.edit_belief(believed);
    BusIndices indices(cell.buses.size());
    std::iota(indices.begin(), indices.end(), std::size_t{0});
    CycleParts parts = build_parts(believed, sensor, compiled, options.settings, through, indices,
                                   [this](const auto& line, double) { return far_end.modbus_client(line.name); });
    if (options.edit_parts) options.edit_parts(parts);
    bring_up(parts, [this](fieldbus::ModbusLine& line) { pump(line, network.now_ns()); });
    return parts;
  }

  // The cycle that begins at or after this time since power on.
  [[nodiscard]] std::size_t cycle_at(double time_s) const {
    return static_cast<std::size_t>(std::ceil((time_s * 1e9 - static_cast<double>(first_cycle_ns)) / 1e6));
  }
  [[nodiscard]] const FaultReport& fault() const { return cycle->supervisor().report(); }

  RigOptions options;
  description::Cell cell;
  description::SensorDescription sensor;
  description::HandDescription hand;
  scenes::Scene scene;
  scenes::CompiledScene compiled;
  fieldbus::SimulatedCanNetwork network;
  sim::SimulatedCell far_end;
  std::unique_ptr<Cycle> cycle;
  std::vector<CycleRecord> records;
  std::vector<sim::Truth> truths;  // at each record's t_k
  SessionTally tally;
  std::int64_t first_cycle_ns = 0;

 private:
  template <typename Description>
  static Description edited(Description description, const std::function<void(Description&)>& edit) {
    if (edit) edit(description);
    return description;
  }
  static std::vector<fieldbus::SimulatedBusConfig> buses_of(const description::Cell& cell, const RigOptions& rig) {
    std::vector<fieldbus::SimulatedBusConfig> buses;
    for (const auto& bus : cell.buses) buses.push_back({.name = bus.name, .restart_ns = rig.restart_ns});
    return buses;
  }
  // A Modbus line's worker on the virtual clock, as fast as it wants to be.
  void pump(fieldbus::ModbusLine& line, std::int64_t time_ns) {
    const std::int64_t next_ns = std::max(line.step(time_ns), time_ns + 1'000'000);
    network.events().schedule(next_ns, [this, &line](std::int64_t t_ns) { pump(line, t_ns); });
  }
  static description::Cell delayed(description::Cell cell, double sensor_delay_s) {
    cell.sensor.delay_s += sensor_delay_s;
    return cell;
  }
  static description::SensorDescription biased(description::SensorDescription sensor, const RigOptions& rig) {
    for (std::size_t i = 0; i < 6; ++i) sensor.simulation.bias_counts[i] += rig.sensor_bias_counts[i];
    return sensor;
  }
  static sim::SimulatedCellConfig with_faults(const RigOptions& rig) {
    sim::SimulatedCellConfig config;
    config.enabling = rig.enabling;
    for (const std::string& text : rig.device_faults) config.faults.push_back(sim::parse_device_fault(text));
    return config;
  }
  void drain() {
    CycleRecord record;
    while (cycle->records().pop(record)) records.push_back(record);
  }
};

// What a drive is sent in three cycles one after the other doesn't go beyond its joint's speed and acceleration. T is
// that of the last step. In counts: each setpoint is rounded by half a one, so a step by one and a difference of steps
// by two.
inline bool step_within_limits(const ClosedLoopRig& rig, std::size_t axis, const CycleRecord& k2, const CycleRecord& k1,
                               const CycleRecord& k) {
  const double T = 1e-9 * static_cast<double>(k.period_ns), ratio = T / (1e-9 * static_cast<double>(k1.period_ns));
  const description::DriveDescription& drive = rig.cell.drives[axis];
  const double per_rad = std::abs(drive.counts_per_rad());
  const double step = k.target_counts[axis] - k1.target_counts[axis];
  const double step_k1 = ratio * (k1.target_counts[axis] - k2.target_counts[axis]);
  return std::abs(step) <= drive.max_speed_rad_per_s * T * per_rad + 1.0 &&
         std::abs(step - step_k1) <= drive.max_acceleration_rad_per_s2 * T * T * per_rad + 1.0 + ratio;
}

inline void expect_step_within_limits(const ClosedLoopRig& rig, std::size_t axis, std::size_t k) {
  const auto counts = [&](std::size_t i) { return rig.records[i].target_counts[axis]; };
  ASSERT_TRUE(step_within_limits(rig, axis, rig.records[k - 2], rig.records[k - 1], rig.records[k]))
      << rig.cell.drives[axis].joint << " in " << k << ": " << counts(k - 2) << ", " << counts(k - 1) << ", "
      << counts(k) << " counts";
}

}  // namespace proxarm::controller::testing
