// One period of the session: the same lines on hardware, on vcan, in-process and in tests; only bus and clock differ.
//
//   t_k        SYNC on every drive bus, then the sensor's poll
//   … 0.45 T   receive, until every drive's TPDO and the sensor's sample are in
//   then       measure, judge, choose the setpoints by the phase, send them (and a heartbeat that is due), record
//
// The setpoints are latched by the drives at SYNC k+1 and, with their interpolation over the period, reached at k+2.
//
// run_cycle() neither allocates, locks, throws nor prints; all that it touches is built before. Precondition: one
// thread calls it. Each stage is a part of its own (BusImage, Measurement, FaultMonitor, Motion, TimestepChange,
// CycleRecorder). Cycle connects them: it knows which phase the session is in, and what that phase does.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "controller/cycle/bus_image.hpp"
#include "controller/cycle/compute_time.hpp"
#include "controller/cycle/cycle_recorder.hpp"
#include "controller/cycle/cycle_status.hpp"
#include "controller/cycle/fault_monitor.hpp"
#include "controller/cycle/past_faults.hpp"
#include "controller/cycle/requests.hpp"
#include "controller/cycle/timestep_change.hpp"
#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/measurement.hpp"
#include "controller/motion/motion.hpp"
#include "controller/motion/tool_change.hpp"
#include "controller/rendering/session_settings.hpp"
#include "controller/supervision/alarm.hpp"
#include "controller/supervision/command.hpp"
#include "controller/supervision/supervisor.hpp"

namespace proxarm::controller {

class Cycle {
 public:
  // `record_capacity`: the number of records that the ring holds until somebody pops them.
  Cycle(CycleParts parts, const SessionSettings& settings, const description::CellLimits& limits,
        std::size_t record_capacity);
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;

  // Runs one period, which begins at t_k.
  void run_cycle(std::int64_t t_k_ns) noexcept;

  // ---- any thread
  [[nodiscard]] const CycleStatus& status() const noexcept { return status_; }
  void request_stop() noexcept { status_.request_stop(); }
  [[nodiscard]] bool stop_requested() const noexcept { return status_.stop_requested(); }

  // ---- one thread for each: the one that asks, and the one that takes the records
  // Changes of parameters, already checked. One is taken per cycle of rendering or of a hold.
  [[nodiscard]] Requests<Change>& changes() noexcept { return requests_.changes; }
  // Changes of the timestep: only if all drives are on CAN and take positions. The arm stops, the drives are told, and
  // rendering goes on. A request waits until the arm is rendering or in a hold.
  [[nodiscard]] Requests<Timestep>& timesteps() noexcept { return requests_.timesteps; }
  // Commands are taken in any phase. One that the phase has no use for is dropped; CycleStatus::refusal() tells
  // beforehand whether it would be.
  [[nodiscard]] Requests<Command>& commands() noexcept { return requests_.commands; }
  // The records of the cycles, for the thread that writes files.
  [[nodiscard]] SpscRing<CycleRecord>& records() noexcept { return recorder_.records(); }

  // ---- the loop's owner, between cycles
  // Precondition: no cycle has run. From then on each cycle's inputs and outputs are also written to `box`.
  void write_to(CycleBox& box) noexcept { recorder_.write_to(box); }
  // Tells the next cycle how many cycles in a row were late; and whether the last one was late by the clock on the
  // wall, which simulated time waited for: that is recorded, and nothing more.
  void report_overruns(std::uint32_t in_a_row, bool was_waited_for = false) noexcept {
    overruns_in_a_row_ = in_a_row;
    was_waited_for_ = was_waited_for;
  }
  // Archives all state that a cycle leaves to the next one. From it and the recorded inputs, a replay computes the same
  // setpoints.
  void archive(fieldbus::StateArchive& state) noexcept;
  // Precondition: the last cycle has run. The drives go back to NMT pre-operational. Never fails.
  void shut_down() noexcept { bus_.shut_down(period_ns()); }

  [[nodiscard]] const Supervisor& supervisor() const noexcept { return supervisor_; }
  // What taring has shown, and the bias as it was followed since.
  [[nodiscard]] const Measurement& measurement() const noexcept { return measurement_; }
  // Null: nothing is counted.
  [[nodiscard]] const MotionWork* work() const noexcept { return motion_->work(); }
  [[nodiscard]] std::span<const ScheduledCommand> scheduled_commands() const noexcept {
    return requests_.commands.script();
  }
  [[nodiscard]] std::span<const ScheduledChange> scheduled_changes() const noexcept {
    return requests_.changes.script();
  }
  [[nodiscard]] std::span<const ScheduledTimestep> scheduled_timesteps() const noexcept {
    return requests_.timesteps.script();
  }
  [[nodiscard]] std::uint64_t rendered_cycles() const noexcept { return state_.rendered_cycles; }
  [[nodiscard]] std::int64_t rendered_ns() const noexcept { return state_.rendered_ns; }
  // The time from the last cycle to the next one.
  [[nodiscard]] std::int64_t period_ns() const noexcept { return ns_of(settings_.period_s); }
  // Whether every drive has reported, after the last cycle, that it no longer holds its axis.
  [[nodiscard]] bool drives_off() const noexcept { return bus_.drives_off(); }
  // The latest eight of the faults that were reset, oldest first; and the number of all that were.
  [[nodiscard]] std::span<const FaultReport> past_faults() const noexcept { return past_faults_.latest(); }
  [[nodiscard]] std::uint64_t past_fault_count() const noexcept { return past_faults_.count(); }
  [[nodiscard]] const CycleParts& parts() const noexcept { return parts_; }

 private:
  struct AllRequests {
    Requests<Change> changes{16};
    Requests<Timestep> timesteps{4};
    Requests<Command> commands{16};
  };
  // The session's state between cycles.
  struct State {
    Phase entered_phase = Phase::idle;  // the phase that enter() was last called for
    std::int64_t phase_since_ns = 0;
    std::int64_t first_cycle_ns = 0;
    std::uint64_t cycle = 0;  // k
    std::uint64_t rendered_cycles = 0;
    std::int64_t rendered_ns = 0;
    bool tared = false;
    bool wants_resume = false;  // to leave this hold: the enabling input was pressed anew, or somebody asked for it
    Command awaits_rest;        // an order to release or back off, given in a hold while the arm still moves
    bool yields = false;        // stopped because of a force, the arm backs off from what presses
    bool yielded = false;       // it has done so
    std::int64_t yields_since_ns = 0;
    std::int64_t moved_ns = 0;  // when a joint of an arm without power last moved
  };

  // cycle.cpp: the stages
  void begin_cycle(std::int64_t t_k_ns) noexcept;
  void measure() noexcept;
  void judge(std::int64_t t_k_ns) noexcept;
  void choose_setpoints(std::int64_t t_k_ns) noexcept;
  void send_setpoints(std::int64_t t_k_ns) noexcept;
  void write_record(std::int64_t t_k_ns) noexcept;
  void end_cycle(const ComputeTime& timed) noexcept;
  void apply(const Timestep& timestep) noexcept;
  void look_ahead(double horizon_s) noexcept;

  // cycle_phases.cpp: what a phase does
  void enter(Phase phase, std::int64_t t_k_ns) noexcept;
  [[nodiscard]] fieldbus::DriveGoal goal_in(Phase phase) const noexcept;
  void act(std::int64_t t_k_ns) noexcept;
  void await_begin(std::int64_t t_k_ns) noexcept;
  void await_enabled(std::int64_t t_k_ns) noexcept;
  void tare(std::int64_t t_k_ns) noexcept;
  void render() noexcept;
  void free() noexcept;
  void run_out(std::int64_t t_k_ns) noexcept;
  void yield(std::int64_t t_k_ns) noexcept;
  [[nodiscard]] bool may_yield() const noexcept;
  void await_disabled(std::int64_t t_k_ns) noexcept;
  [[nodiscard]] bool runs_down(std::int64_t t_k_ns) noexcept;
  void await_reset(std::int64_t t_k_ns) noexcept;
  [[nodiscard]] MotionCycle motion_cycle() noexcept;
  [[nodiscard]] double in_phase_s(std::int64_t t_k_ns) const noexcept;

  // cycle_requests.cpp: what somebody asks for
  void heed_enabling_input(std::int64_t t_k_ns) noexcept;
  void take_command(std::int64_t t_k_ns) noexcept;
  void obey(const Command& command) noexcept;
  void start_freeing(const Command& command) noexcept;
  [[nodiscard]] bool awaits_rest() const noexcept { return state_.awaits_rest.order != Order::none; }
  void reset() noexcept;
  void take_timestep() noexcept;
  void change_timestep(std::int64_t t_k_ns) noexcept;
  void take_change() noexcept;
  [[nodiscard]] const char* take_tool(const Change& change) noexcept;
  void fade_tool() noexcept;
  void carry_tool() noexcept;
  void supervise_hold(std::int64_t t_k_ns) noexcept;
  [[nodiscard]] bool may_move() const noexcept;
  [[nodiscard]] bool stands_in_hold() const noexcept;
  // The number of cycles that `time_s` lasts, rounded up.
  [[nodiscard]] std::uint64_t cycles_of(double time_s) const noexcept;

  CycleParts parts_;
  SessionSettings settings_;
  AllRequests requests_;
  CycleStatus status_;
  Supervisor supervisor_;
  State state_;
  Alarm alarm_;
  CycleRecorder recorder_;
  BusImage bus_;
  Measurement measurement_;
  FaultMonitor faults_;
  std::unique_ptr<Motion> motion_;
  TimestepChange timestep_;
  ToolChange tool_;
  PastFaults past_faults_;
  std::uint32_t overruns_in_a_row_ = 0;
  bool was_waited_for_ = false;
};

}  // namespace proxarm::controller
