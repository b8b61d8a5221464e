// Runs the periods of a session. Hardware, vcan, in-process simulation and tests run this code; only bus and clock
// differ.
//
//   at t_k              Send SYNC on every drive bus, then the sensor's poll.
//   until t_k + 0.45 T  Receive, until every drive's TPDO and the sensor's sample have arrived.
//   after that          Measure, judge, choose the setpoints by the phase, send them (and the heartbeat if it is due),
//                       record.
//
// The drives latch the setpoints at SYNC k+1, interpolate over the period, and reach the setpoints at SYNC k+2.
//
// run_cycle() doesn't allocate, lock, throw or print; all objects are built before the first cycle. Precondition: only
// one thread calls run_cycle(). Each stage is a separate part (BusImage, Measurement, FaultMonitor, Motion,
// TimestepChange, CycleRecorder). Cycle connects these parts, and acts by the session's phase.
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
  // record_capacity: largest number of records that wait in the ring until the writing thread pops them.
  Cycle(CycleParts parts, const SessionSettings& settings, const description::CellLimits& limits,
        std::size_t record_capacity);
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;

  // Runs the period that begins at t_k.
  void run_cycle(std::int64_t t_k_ns) noexcept;

  // ---- any thread
  [[nodiscard]] const CycleStatus& status() const noexcept { return status_; }
  void request_stop() noexcept { status_.request_stop(); }
  [[nodiscard]] bool stop_requested() const noexcept { return status_.stop_requested(); }

  // ---- one thread for each ring: a thread that makes requests, a thread that takes the records
  // Requests for checked changes of parameters. In rendering and in holds, a cycle takes at most one request.
  [[nodiscard]] Requests<Change>& changes() noexcept { return requests_.changes; }
  // Requests for another timestep. Precondition: all drives are on CAN and take positions. The arm stops, the drives
  // get the new timestep, and rendering continues. A request waits until the arm is rendering or in a hold.
  [[nodiscard]] Requests<Timestep>& timesteps() noexcept { return requests_.timesteps; }
  // Commands. They are taken in every phase, and dropped if they don't apply to it; CycleStatus::refusal() returns
  // in advance whether a command applies.
  [[nodiscard]] Requests<Command>& commands() noexcept { return requests_.commands; }
  // The records, for the thread that writes files.
  [[nodiscard]] SpscRing<CycleRecord>& records() noexcept { return recorder_.records(); }

  // ---- the loop's owner, between cycles
  // Makes all cycles write their inputs and outputs to `box`, too. Precondition: no cycle has run.
  void write_to(CycleBox& box) noexcept { recorder_.write_to(box); }
  // Reports to the next cycle how many consecutive cycles were late. was_waited_for: the last cycle was late by the
  // wall clock, but simulated time waited for it; this is only recorded.
  void report_overruns(std::uint32_t in_a_row, bool was_waited_for = false) noexcept {
    overruns_in_a_row_ = in_a_row;
    was_waited_for_ = was_waited_for;
  }
  // Archives all state that a cycle leaves to the next cycle. From this state and the recorded inputs, a replay
  // computes the session's setpoints again.
  void archive(fieldbus::StateArchive& state) noexcept;
  // Ends the drives' cyclic communication (BusImage::shut_down()). Precondition: the last cycle has run.
  void shut_down() noexcept { bus_.shut_down(period_ns()); }

  [[nodiscard]] const Supervisor& supervisor() const noexcept { return supervisor_; }
  // The measurements, with the results of the tare and the present bias.
  [[nodiscard]] const Measurement& measurement() const noexcept { return measurement_; }
  // Null: the motion doesn't count its computations.
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
  // Time from the last cycle to the next.
  [[nodiscard]] std::int64_t period_ns() const noexcept { return ns_of(settings_.period_s); }
  // Whether all drives have reported that they no longer hold their joints. Call after the last cycle.
  [[nodiscard]] bool drives_off() const noexcept { return bus_.drives_off(); }
  // The latest eight faults that were reset, oldest first.
  [[nodiscard]] std::span<const FaultReport> past_faults() const noexcept { return past_faults_.latest(); }
  // The number of all faults that were reset.
  [[nodiscard]] std::uint64_t past_fault_count() const noexcept { return past_faults_.count(); }
  [[nodiscard]] const CycleParts& parts() const noexcept { return parts_; }

 private:
  struct AllRequests {
    Requests<Change> changes{16};
    Requests<Timestep> timesteps{4};
    Requests<Command> commands{16};
  };
  // The session's state from cycle to cycle.
  struct State {
    Phase entered_phase = Phase::idle;  // the phase of the last enter()
    std::int64_t phase_since_ns = 0;
    std::int64_t first_cycle_ns = 0;
    std::uint64_t cycle = 0;  // k
    std::uint64_t rendered_cycles = 0;
    std::int64_t rendered_ns = 0;
    bool tared = false;
    bool wants_resume = false;  // rendering shall continue: the enabling input was pressed anew, or by command
    Command awaits_rest;        // order to release or back off, given before the arm stood
    bool yields = false;        // the arm was stopped because of a force, and yields to this force
    bool yielded = false;       // yielding is over
    std::int64_t yields_since_ns = 0;
    std::int64_t moved_ns = 0;  // last time at which a joint of an arm without power moved
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

  // cycle_phases.cpp: actions of the phases
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

  // cycle_requests.cpp: requests
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
  // Returns the number of cycles in time_s, rounded up.
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
