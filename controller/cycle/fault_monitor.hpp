// Judges in each cycle the state and timing of buses, drives, sensor, enabling input and control loop.
//
// It raises faults (fault.hpp); the supervisor decides the reaction. The motion raises the faults that it detects, such
// as an exceeded leash or a proxy that isn't finite.
//
// A cycle counts as late if the sensor's sample has been missing for max_missed_samples/3 cycles. The lateness score is
// in sixteenths of a sample: each late cycle adds 16, every other cycle subtracts 1. So the score grows if more than
// one cycle in 17 is late. A score of more than eight samples (128) is the fault sensor_late.
//
// Nothing allocates, locks or throws after construction.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "controller/handle/force_jump.hpp"
#include "controller/motion/measurement.hpp"
#include "controller/record/black_box.hpp"
#include "controller/rendering/session_settings.hpp"
#include "controller/supervision/alarm.hpp"
#include "controller/supervision/drive_monitor.hpp"
#include "controller/supervision/enabling_input.hpp"
#include "controller/supervision/standstill_monitor.hpp"
#include "controller/supervision/supervisor.hpp"
#include "controller/supervision/tool_monitor.hpp"
#include "fieldbus/can/can_network.hpp"
#include "fieldbus/cia402/cyclic_drive.hpp"
#include "fieldbus/sensors/force_sensor.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

// All inputs for judging a cycle.
struct JudgedCycle {
  const Measured& measured;
  const fieldbus::ForceSample& sample;           // the sensor's latest sample
  const EnablingInput* enabling = nullptr;       // null: the cell has no enabling input
  std::span<const fieldbus::BusStatus> buses{};  // status of each bus, in the network's order
  std::uint32_t overruns_in_a_row = 0;
  bool telling = false;                    // SDO answers are on the buses and may delay a drive's TPDO by one frame
  bool tared = false;                      // the tare is complete, so drives are enabled after a reset
  bool stands = false;                     // the arm should stand still
  bool backs_off = false;                  // the arm backs off in a fixed direction
  std::optional<models::Wrench> load_S{};  // the reading without bias; nullopt: no hand moves the arm
};

// Bounds of the sensor's and the encoders' readings. A reading beyond a bound is a fault.
struct ReadingBounds {
  double max_force_N = 0.0;
  double max_bias_drift_N = 0.0;
  double beyond_range_rad = 0.0;  // allowed angle of a joint beyond the end of its range, at the start
  double max_force_step_N = std::numeric_limits<double>::infinity();  // force_jump.hpp
  models::Vec3 handle_S = models::Vec3::Zero();                       // handle point, from the sensor's origin
};

class FaultMonitor {
 public:
  // `tool`, `drives_follow`: nullopt if the drives take torques, since a hand then moves the arm freely. In `settings`,
  // T and the counts of cycles may change later. Precondition: the references outlive this object.
  FaultMonitor(std::span<const DriveOnBus> drives, const SessionSettings& settings, const ReadingBounds& bounds,
               const Supervisor& supervisor, Alarm& alarm, std::optional<ToolMonitor> tool = {},
               std::optional<DriveMonitor> drives_follow = {},
               std::optional<StandstillMonitor> standstill = {}) noexcept
      : drives_(drives),
        settings_(settings),
        bounds_(bounds),
        supervisor_(supervisor),
        alarm_(alarm),
        jump_({.max_step_N = bounds.max_force_step_N, .least_N = bounds.max_bias_drift_N, .handle_S = bounds.handle_S}),
        tool_(std::move(tool)),
        drives_follow_(std::move(drives_follow)),
        standstill_(std::move(standstill)) {}

  // Judges by the encoders: whether a joint can have reached its position since its last report, whether drives are
  // near their setpoints, and whether the tool keeps its limits. `entered`: phase of the previous cycle. Phases in
  // which no drive holds the arm aren't judged, since a person may then move the arm by hand.
  void judge_encoders(const Measured& measured, Phase entered) noexcept;
  // Judges everything else.
  void judge(const JudgedCycle& cycle) noexcept;

  // Call after a reset: earlier faults then no longer count. `buses`: see JudgedCycle.
  void forget(std::span<const fieldbus::BusStatus> buses) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    jump_.archive(state);
    if (tool_) tool_->archive(state);
    if (drives_follow_) drives_follow_->archive(state);
    if (standstill_) standstill_->archive(state);
  }

 private:
  struct State {
    std::uint32_t missed_samples = 0;  // number of consecutive cycles without a sample
    std::uint32_t late_score = 0;      // lateness score
    double since_sample_s = 0.0;       // time from the last sample to the last cycle
    std::uint8_t faulty = 0;           // drives whose reported fault has been judged
    // For each bus: the number of lost frames that no longer count as a fault.
    std::array<std::uint64_t, max_buses> overflows_before{};
  };

  void judge_joints(const Measured& measured, Phase entered) noexcept;
  void judge_following(const Measured& measured, Phase entered) noexcept;
  void judge_tool(const Measured& measured, Phase entered) noexcept;
  void judge_enabling(const EnablingInput* enabling) noexcept;
  void judge_start(const JudgedCycle& cycle) noexcept;
  void judge_standstill(const JudgedCycle& cycle) noexcept;
  void judge_buses(std::span<const fieldbus::BusStatus> buses) noexcept;
  void judge_drives(bool telling) noexcept;
  void judge_switching_off() noexcept;
  void judge_drive_fault(std::int32_t where, fieldbus::DriveFault fault) noexcept;
  void judge_sensor(const JudgedCycle& cycle) noexcept;
  void judge_sample(const JudgedCycle& cycle) noexcept;
  void judge_jump(const JudgedCycle& cycle) noexcept;
  void judge_lateness(bool late) noexcept;
  [[nodiscard]] bool any_has_power() const noexcept;
  [[nodiscard]] bool needs_force(const JudgedCycle& cycle) const noexcept;

  std::span<const DriveOnBus> drives_;
  const SessionSettings& settings_;
  ReadingBounds bounds_;
  const Supervisor& supervisor_;
  Alarm& alarm_;
  ForceJump jump_;
  std::optional<ToolMonitor> tool_;
  std::optional<DriveMonitor> drives_follow_;
  std::optional<StandstillMonitor> standstill_;
  State state_;
};

}  // namespace proxarm::controller
