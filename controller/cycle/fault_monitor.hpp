// Judges, cycle by cycle, what came from the devices and when: buses, drives, sensor, enabling input, the loop itself.
//
// It raises faults (fault.hpp); how the arm reacts is up to the supervisor. What the motion finds out by itself (a
// leash that is too long, a proxy that isn't finite) isn't judged here.
//
// A sample counts as late from max_missed_samples/3 cycles without one on. Lateness is scored in sixteenths of a
// sample: each late cycle adds 16, each other one subtracts 1. The score therefore grows if more than one cycle in 17
// is late; above eight samples (128) it is a fault.
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

// All that a cycle is judged by.
struct JudgedCycle {
  const Measured& measured;
  const fieldbus::ForceSample& sample;           // the sensor's latest
  const EnablingInput* enabling = nullptr;       // null if there is none
  std::span<const fieldbus::BusStatus> buses{};  // by their index in the network
  std::uint32_t overruns_in_a_row = 0;
  bool telling = false;                    // SDO answers are on the buses and may delay a drive's TPDO by one frame
  bool tared = false;                      // the sensor has been tared, so this is no first enabling
  bool stands = false;                     // the arm is meant to stand still
  bool backs_off = false;                  // while it is freed, the arm moves in a direction that is set
  std::optional<models::Wrench> load_S{};  // what the sensor reads without its bias; nullopt: no hand moves the arm
};

// What is read beyond these bounds is a fault.
struct ReadingBounds {
  double max_force_N = 0.0;
  double max_bias_drift_N = 0.0;
  double beyond_range_rad = 0.0;  // by which a joint may stand out of its range at the start
  double max_force_step_N = std::numeric_limits<double>::infinity();  // force_jump.hpp
  models::Vec3 handle_S = models::Vec3::Zero();                       // the handle's point, from the sensor's origin
};

class FaultMonitor {
 public:
  // `drives_follow` and `tool` are nullopt if the drives take torques, since a hand then moves the arm as it likes.
  // Precondition: all arguments but these two and `bounds` outlive this object. T, and what is counted in cycles, may
  // change in `settings`.
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

  // Judges whether an encoder's position can have been reached since its last report, and whether a drive is near what
  // it was told. `entered`: the phase of the cycle before. In phases in which no drive holds the arm, it may be moved
  // by hand and isn't judged.
  void judge_encoders(const Measured& measured, Phase entered) noexcept;
  void judge(const JudgedCycle& cycle) noexcept;

  // After a reset, what was wrong before no longer counts. `buses` as in judge().
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
    std::uint32_t missed_samples = 0;                         // in a row
    std::uint32_t late_score = 0;                             // see the file's head
    double since_sample_s = 0.0;                              // up to the last cycle
    std::uint8_t faulty = 0;                                  // drives that report a fault, and have been judged for it
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
