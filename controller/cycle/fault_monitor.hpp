// Judges in each cycle the state and timing of the devices: buses, drives, sensor, enabling input and the loop itself.
//
// It raises faults (fault.hpp); the supervisor decides the reaction. Faults that the motion detects (such as a leash
// that is too long, or a proxy that isn't finite) aren't judged here.
//
// A sample counts as late after max_missed_samples/3 cycles without one. The lateness score is in sixteenths of a
// sample: each late cycle adds 16, each other one subtracts 1. So the score grows if more than one cycle in 17 is late;
// above eight samples (128) it is a fault.
//
// No allocation, lock or throw after construction.
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
  const fieldbus::ForceSample& sample;           // the sensor's latest
  const EnablingInput* enabling = nullptr;       // null: none
  std::span<const fieldbus::BusStatus> buses{};  // by their index in the network
  std::uint32_t overruns_in_a_row = 0;
  bool telling = false;                    // SDO answers are on the buses and may delay a drive's TPDO by one frame
  bool tared = false;                      // the tare is done, so this is no first enabling
  bool stands = false;                     // the arm should stand still
  bool backs_off = false;                  // the arm backs off in a fixed direction
  std::optional<models::Wrench> load_S{};  // the reading without bias; nullopt: no hand moves the arm
};

// Readings beyond these bounds are faults.
struct ReadingBounds {
  double max_force_N = 0.0;
  double max_bias_drift_N = 0.0;
  double beyond_range_rad = 0.0;  // allowed distance of a joint outside its range at the start
  double max_force_step_N = std::numeric_limits<double>::infinity();  // force_jump.hpp
  models::Vec3 handle_S = models::Vec3::Zero();                       // handle point, from the sensor's origin
};

class FaultMonitor {
 public:
  // drives_follow and tool: nullopt if the drives take torques, since a hand then moves the arm freely. Precondition:
  // the references outlive this object. In `settings`, T and the counts of cycles may change.
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

  // Judges whether an encoder can have reached its position since its last report, and whether drives are near their
  // setpoints. `entered`: phase of the previous cycle. Phases in which no drive holds the arm aren't judged, since it
  // may be moved by hand.
  void judge_encoders(const Measured& measured, Phase entered) noexcept;
  void judge(const JudgedCycle& cycle) noexcept;

  // After a reset, earlier faults no longer count. `buses` as in judge().
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
    std::uint32_t missed_samples = 0;                         // consecutive
    std::uint32_t late_score = 0;                             // see the file's head
    double since_sample_s = 0.0;                              // up to the last cycle
    std::uint8_t faulty = 0;                                  // drives that report a fault and have been judged for it
    std::array<std::uint64_t, max_buses> overflows_before{};  // frames lost by each bus that no longer count as a fault
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
