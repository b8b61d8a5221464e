#include <algorithm>
#include <cstdio>
#include <optional>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/entry/exit_status.hpp"
#include "controller/record/replay_log.hpp"
#include "controller/session/bring_up.hpp"
#include "controller/session/reachable_scene.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/json.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using controller::BoxCycle;
using controller::BoxFrame;
using description::Json;
using description::SetupError;

constexpr int other_setpoints = 1;

// A Modbus line without a device. The record gives the devices' answers instead.
class NoLine final : public fieldbus::ModbusClient {
 public:
  fieldbus::ModbusResult transact(const fieldbus::ModbusMessage&, fieldbus::ModbusMessage&) noexcept override {
    return fieldbus::ModbusResult::closed;
  }
};

struct Difference {
  std::uint64_t cycle = 0;
  std::size_t axis = 0;
  std::int32_t recorded = 0, replayed = 0;
};

class Replay {
 public:
  explicit Replay(const fs::path& folder)
      : log_(folder / controller::replay_folder / "cycles.bin"),
        cell_(description::load_cell(controller::recorded_file(folder, log_.head().cell.data()))),
        sensor_(description::load_sensor(cell_.sensor.description, cell_.sensor.choices)),
        scene_(scenes::compile(controller::reachable_scene(
            scenes::load_scene_with(controller::recorded_file(folder, log_.head().scene.data()),
                                    controller::recorded_tool(folder, log_.head())),
            cell_))),
        network_(log_.head()) {
    const controller::ReplayHead& head = log_.head();
    if (cell_.drives.size() != head.axes || cell_.buses.size() > controller::max_buses) {
      throw SetupError({.file = cell_.file.string(),
                        .found = std::to_string(cell_.drives.size()) + " drives",
                        .expected = std::to_string(head.axes) + ", as recorded"});
    }
    const auto recorded = [&](std::uint8_t bus) { return bus < head.buses; };
    if (!std::all_of(head.bus_of_cell_bus.begin(),
                     head.bus_of_cell_bus.begin() + static_cast<std::ptrdiff_t>(cell_.buses.size()), recorded)) {
      throw SetupError({.file = cell_.file.string(),
                        .key = "buses",
                        .found = std::to_string(cell_.buses.size()),
                        .expected = std::to_string(head.buses) + ", as recorded"});
    }
    controller::BusIndices indices(head.bus_of_cell_bus.begin(),
                                   head.bus_of_cell_bus.begin() + static_cast<std::ptrdiff_t>(cell_.buses.size()));
    const auto open_line = [](const description::ModbusLineDescription&, double) { return std::make_unique<NoLine>(); };
    controller::CycleParts parts =
        controller::build_parts(cell_, sensor_, scene_, head.settings, network_, indices, open_line,
                                [](const auto&) { return std::make_unique<fieldbus::NoDatagrams>(); });
    cycle_ = std::make_unique<controller::Cycle>(std::move(parts), head.settings, cell_.limits, 2);
    fieldbus::StateArchive state = fieldbus::StateArchive::reader(log_.state());
    cycle_->archive(state);
    if (state.whole() && state.bytes() == log_.state().size()) return;
    throw SetupError({.file = (folder / controller::replay_folder / "cycles.bin").string(),
                      .found = "a state of " + std::to_string(log_.state().size()) + " bytes",
                      .expected = std::to_string(state.bytes()) + ", as this version's controller has it"});
  }

  // Replays all cycles up to the first setpoint that differs from the record. Returns the difference, or nullopt if
  // there is none.
  std::optional<Difference> run() {
    BoxCycle recorded;
    std::vector<BoxFrame> frames;
    controller::CycleRecord replayed;
    while (log_.next(recorded, frames)) {
      give(recorded, frames);
      cycle_->run_cycle(recorded.t_k_ns);
      cycle_->records().pop(replayed);
      ++cycles_;
      for (std::size_t axis = 0; axis < cell_.drives.size(); ++axis) {
        const std::int32_t then = recorded.record.target_counts[axis], now = replayed.target_counts[axis];
        if (then != now) return Difference{recorded.record.cycle, axis, then, now};
      }
    }
    return {};
  }

  [[nodiscard]] std::uint64_t cycles() const noexcept { return cycles_; }
  [[nodiscard]] std::uint64_t first_cycle() const noexcept { return log_.head().first_cycle; }
  [[nodiscard]] const std::string& joint(std::size_t axis) const { return cell_.drives[axis].joint; }

 private:
  void give(const BoxCycle& recorded, const std::vector<BoxFrame>& frames) {
    network_.load(recorded, frames);
    cycle_->report_overruns(recorded.overruns_in_a_row);
    if (recorded.change.parameter != controller::Parameter::none) cycle_->changes().push(recorded.change);
    if (recorded.command.order != controller::Order::none) cycle_->commands().push(recorded.command);
    if (recorded.timestep.period_s > 0.0) cycle_->timesteps().push(recorded.timestep);
    if (recorded.stop_requested) cycle_->request_stop();
    fieldbus::StateArchive inputs =
        fieldbus::StateArchive::reader(std::span(recorded.inputs).first(recorded.input_bytes));
    for (const controller::DriveOnBus& axis : cycle_->parts().drives) axis.drive.archive_input(inputs);
    cycle_->parts().sensor->archive_input(inputs);
  }

  controller::ReplayReader log_;
  description::Cell cell_;
  description::SensorDescription sensor_;
  scenes::CompiledScene scene_;
  controller::ReplayNetwork network_;
  std::unique_ptr<controller::Cycle> cycle_;
  std::uint64_t cycles_ = 0;
};

}  // namespace

int replay_command(const ReplayOptions& options) {
  Replay replay(options.folder);
  const std::optional<Difference> difference = replay.run();
  if (replay.cycles() == 0) {
    throw SetupError({.file = options.folder.string(), .found = "no cycle", .expected = "at least one"});
  }
  Json json{{"same", !difference}, {"first_cycle", replay.first_cycle()}};
  std::string text;
  if (!difference) {
    json["cycles"] = replay.cycles();
    text = std::to_string(replay.cycles()) + " cycles from " + std::to_string(replay.first_cycle()) +
           " on: every setpoint is the same to the bit";
  } else {
    const std::string& joint = replay.joint(difference->axis);
    json.update({{"cycle", difference->cycle},
                 {"axis", joint},
                 {"recorded", difference->recorded},
                 {"replayed", difference->replayed}});
    text = "cycle " + std::to_string(difference->cycle) + ", " + joint + ": recorded " +
           std::to_string(difference->recorded) + " counts, replayed " + std::to_string(difference->replayed);
  }
  std::puts(options.json ? json.dump().c_str() : text.c_str());
  return difference ? other_setpoints : fine;
}

}  // namespace proxarm::command_line
