// One period of the session, the same lines on hardware, on vcan, in-process and in tests; only bus and clock differ.
//
//   t_k        SYNC on every drive bus, then the sensor's poll
//   … 0.45 T   receive, until every drive's TPDO and the sensor's sample are in
//   then       judge ages and states, compensate, step the proxy (26), solve the arm, send the RPDOs (and, after them,
//              the heartbeat where one is due), record
//
// The targets are latched by the drives at SYNC k+1 and, with their interpolation over the period, reached at k+2.
//
// run_cycle() neither allocates, locks, throws nor prints; all that it touches was built before. One thread calls it.
// The supervisor's phase says what the targets are: the actual positions (enabling), still (taring, disabling), the
// proxy's (rendering), or the last ones run out at the joints' own deceleration (stopping).
//
// Impedance type (torque_rendering.hpp): the same cycle, with torques for where the tool is. Until rendering they hold
// it where it stands; stopping is the drives' own, from whatever torque on their slow-down ramp (6084h).
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "controller/black_box.hpp"
#include "controller/change.hpp"
#include "controller/command.hpp"
#include "controller/cycle_record.hpp"
#include "controller/elastic_setpoint.hpp"
#include "controller/enabling_input.hpp"
#include "controller/free_motion.hpp"
#include "controller/joint_guard.hpp"
#include "controller/orientation_proxy.hpp"
#include "controller/passivity.hpp"
#include "controller/rendered_world.hpp"
#include "controller/session_settings.hpp"
#include "controller/spsc_ring.hpp"
#include "controller/step_limits.hpp"
#include "controller/supervisor.hpp"
#include "controller/torque_rendering.hpp"
#include "controller/wrench_compensation.hpp"
#include "fieldbus/can_network.hpp"
#include "fieldbus/canopen_heartbeat.hpp"
#include "fieldbus/canopen_sync.hpp"
#include "fieldbus/cia402_bring_up.hpp"
#include "fieldbus/cia402_period.hpp"
#include "fieldbus/force_sensor.hpp"
#include "fieldbus/modbus_line.hpp"
#include "models/arm.hpp"
#include "models/inverse_kinematics.hpp"

namespace proxarm::controller {

// How long a cycle waits for feedback and samples, as a fraction of T; in what is left the targets are computed and
// sent.
inline constexpr double receive_window = 0.45;

// An axis' drive, of either kind.
struct DriveOnBus {
  static constexpr std::size_t no_bus = static_cast<std::size_t>(-1);

  std::unique_ptr<fieldbus::CyclicDrive> owned;
  fieldbus::CyclicDrive& drive;  // *owned
  std::size_t bus;               // index in the network; no_bus: on a Modbus line
};

// A bus with drives: who gets SYNC and the controller's heartbeat.
struct DriveBus {
  std::size_t bus;
  fieldbus::SyncProducer sync;
  fieldbus::HeartbeatProducer heartbeat;
};

// All that a cycle works on, built and configured before the first one. Drives in the order of the arm's joints.
struct CycleParts {
  fieldbus::CanNetwork& network;
  std::vector<DriveOnBus> drives;
  std::vector<fieldbus::DriveSlot> can_drives;  // those of them on CAN; with torques, all. The others are their line's
  std::vector<DriveBus> drive_buses;
  std::unique_ptr<fieldbus::ForceSensor> sensor;
  std::size_t sensor_bus;                                           // DriveOnBus::no_bus: on a Modbus line
  std::vector<std::unique_ptr<fieldbus::ModbusLine>> modbus_lines;  // their workers end before drives and sensor do
  std::unique_ptr<models::Arm> arm;                  // in one place for good: the inverse kinematics refers to it
  std::optional<models::InverseKinematics> inverse;  // admittance type
  ElasticSetpoint elastic;
  std::unique_ptr<RenderedWorld> world;     // admittance type
  std::unique_ptr<TorqueRendering> torque;  // impedance type
  OrientationProxy orientation;
  WrenchCompensation compensation;
  std::optional<EnablingInput> enabling;
  std::unique_ptr<FreeMotion> freeing;  // admittance type
  description::SupervisionDescription supervision;
};

class Cycle {
 public:
  // `record_capacity`: cycles that the ring holds until somebody pops them.
  Cycle(CycleParts parts, const SessionSettings& settings, const description::CellLimits& limits,
        std::size_t record_capacity);

  // One period, begun at t_k.
  void run_cycle(std::int64_t t_k_ns) noexcept;

  // Any thread: asks for a controlled stop at the next cycle.
  void request_stop() noexcept { stop_requested_.store(true, std::memory_order_relaxed); }
  // Checked parameters for the next cycles of rendering or of a hold, one each, from one thread; and those of a script,
  // by their times.
  [[nodiscard]] SpscRing<Change>& changes() noexcept { return changes_; }
  void schedule(std::vector<ScheduledChange> changes) { scheduled_ = std::move(changes); }
  // Another T, by the same rules; the drives are on CAN and take positions. The arm stops, the drives are told,
  // rendering goes on. It waits until the arm is rendering or in a hold.
  [[nodiscard]] SpscRing<Timestep>& timesteps() noexcept { return timesteps_; }
  void schedule(std::vector<ScheduledTimestep> timesteps) { scheduled_timesteps_ = std::move(timesteps); }
  // Any thread: why the timestep can't be changed now; nullptr: it can.
  [[nodiscard]] const char* timestep_refusal() const noexcept;
  // Any thread: T, s, and whether it is being changed.
  [[nodiscard]] double shown_period_s() const noexcept { return shown_period_s_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool changes_timestep() const noexcept { return shown_change_.load(std::memory_order_relaxed); }
  // How many of those that came through timesteps() are over, taken or not.
  [[nodiscard]] std::uint32_t answered_timesteps() const noexcept {
    return answered_timesteps_.load(std::memory_order_acquire);
  }
  // The same of commands, in any phase. One that the phase has no use for is dropped; refusal() says so beforehand.
  [[nodiscard]] SpscRing<Command>& commands() noexcept { return commands_; }
  void schedule(std::vector<ScheduledCommand> commands) { scripted_ = std::move(commands); }
  // Any thread: why a command would do nothing now; nullptr: it would do something.
  [[nodiscard]] const char* refusal(Order order) const noexcept;
  // Any thread: the phase of the last cycle.
  [[nodiscard]] Phase shown_phase() const noexcept { return shown_phase_.load(std::memory_order_relaxed); }
  // The loop's owner: this many cycles in a row were late.
  void report_overruns(std::uint32_t in_a_row) noexcept { overruns_in_a_row_ = in_a_row; }

  // Before the first cycle: what it is given and what it does is also written there.
  void write_to(BlackBox& box) noexcept { box_ = &box; }
  // All that a cycle leaves to the next one: with it and what the cycles are given, a replay gives the same setpoints.
  void archive(fieldbus::StateArchive& state) noexcept;

  // After the last cycle: drives back to NMT pre-operational. Never fails.
  void shut_down() noexcept;

  [[nodiscard]] const Supervisor& supervisor() const noexcept { return supervisor_; }
  [[nodiscard]] std::uint64_t rendered_cycles() const noexcept { return rendered_cycles_; }
  [[nodiscard]] std::int64_t rendered_ns() const noexcept { return rendered_ns_; }
  // From the last cycle to the next one.
  [[nodiscard]] std::int64_t period_ns() const noexcept { return period_ns_; }
  // After the last cycle: whether every drive has said that it doesn't hold its axis any more.
  [[nodiscard]] bool drives_off() const noexcept;
  // Faults that were reset, the latest eight, the oldest of them first; and how many there were.
  [[nodiscard]] std::span<const FaultReport> past_faults() const noexcept {
    return std::span(past_faults_).first(std::min<std::size_t>(past_fault_count_, past_faults_.size()));
  }
  [[nodiscard]] std::uint64_t past_fault_count() const noexcept { return past_fault_count_; }
  [[nodiscard]] const CycleParts& parts() const noexcept { return parts_; }
  [[nodiscard]] SpscRing<CycleRecord>& records() noexcept { return records_; }

 private:
  using JointVector = models::JointVector;
  using SteadyTime = std::chrono::steady_clock::time_point;

  // Frames for one bus that go to its interface together.
  struct Outbox {
    std::array<fieldbus::CanFrame, 16> frames{};
    std::size_t count = 0;
  };

  void begin_cycle(std::int64_t t_k_ns) noexcept;
  void receive_until(std::int64_t deadline_ns) noexcept;
  void receive_all() noexcept;
  void deliver(std::size_t bus, const fieldbus::TimedFrame& received) noexcept;
  [[nodiscard]] bool is_masters_own(std::size_t bus, const fieldbus::CanFrame& frame) const noexcept;
  bool everything_received() const noexcept;
  void measure() noexcept;
  void judge(std::int64_t t_k_ns) noexcept;
  void judge_sensor() noexcept;
  void judge_drives() noexcept;
  void judge_buses() noexcept;
  void choose_targets(std::int64_t t_k_ns) noexcept;
  void act(std::int64_t t_k_ns) noexcept;
  void await_enabled(std::int64_t t_k_ns) noexcept;
  void await_disabled(std::int64_t t_k_ns) noexcept;
  void tare(std::int64_t t_k_ns) noexcept;
  void start_rendering() noexcept;
  void render() noexcept;
  void take_change() noexcept;
  // cycle_supervision.cpp
  void judge_enabling(std::int64_t t_k_ns) noexcept;
  void judge_encoder(Eigen::Index axis, double moved_rad) noexcept;
  void judge_lateness(bool late) noexcept;
  [[nodiscard]] bool may_move() const noexcept;
  [[nodiscard]] bool needs_force() const noexcept;
  void take_command(std::int64_t t_k_ns) noexcept;
  void obey(const Command& command) noexcept;
  void supervise_hold(std::int64_t t_k_ns) noexcept;
  void await_begin(std::int64_t t_k_ns) noexcept;
  void await_reset(std::int64_t t_k_ns) noexcept;
  void reset() noexcept;
  // cycle_timestep.cpp
  enum class TimestepStage : std::uint8_t { none, coming_to_rest, telling, taking_back, unknown };
  void take_timestep() noexcept;
  void change_timestep(std::int64_t t_k_ns) noexcept;
  void begin_telling() noexcept;
  void take_timestep_back(const fieldbus::PeriodRefusal& refusal) noexcept;
  void end_timestep() noexcept;
  void apply_period(double period_s) noexcept;
  void archive_timestep(fieldbus::StateArchive& state) noexcept;
  void send_period_requests(std::int64_t t_k_ns) noexcept;
  // Under way, or next in the script.
  [[nodiscard]] bool timestep_is_due() const noexcept {
    return changing() || (next_timestep_ < scheduled_timesteps_.size() &&
                          scheduled_timesteps_[next_timestep_].rendered_ns <= rendered_ns_);
  }
  // SDO answers are on the bus beside the cycle's frames.
  [[nodiscard]] bool telling() const noexcept {
    return timestep_stage_ == TimestepStage::telling || timestep_stage_ == TimestepStage::taking_back;
  }
  [[nodiscard]] bool changing() const noexcept { return timestep_stage_ != TimestepStage::none; }
  // cycle_supervision.cpp, further
  void start_run_out(Phase from) noexcept;
  void start_freeing(const Command& command) noexcept;
  void free_motion() noexcept;
  void limit_speed() noexcept;
  void ramp_in() noexcept;
  [[nodiscard]] bool stands() const noexcept { return run_out_scale_ <= 0.0 && guard_.at_rest(); }
  [[nodiscard]] RenderedWorld& world() noexcept {
    return entered_phase_ == Phase::freeing ? parts_.freeing->world() : *parts_.world;
  }
  void make_limits() noexcept;
  void hold() noexcept;
  void render_torques() noexcept;
  void record_world(const WorldStep& step) noexcept;
  void record_passivity(const WorldStep& step) noexcept;
  void follow_proxy() noexcept;
  void command(const JointVector& motor_rad) noexcept;
  std::uint8_t find_blocked(const JointVector& motor_rad, JointVector& wanted_rad) noexcept;
  void wind_back(std::uint8_t blocked) noexcept;
  void run_out() noexcept;
  void send_targets(std::int64_t t_k_ns) noexcept;
  void send(std::size_t bus, const fieldbus::CanFrame& frame) noexcept;
  void hand_over(std::size_t bus) noexcept;
  void hand_over() noexcept;
  void raise(Fault fault, std::int32_t where, double value = 0.0, double limit = 0.0) noexcept;
  void write_record(std::int64_t t_k_ns) noexcept;
  void begin_box(std::int64_t t_k_ns) noexcept;
  void finish_box() noexcept;
  void enter(Phase phase, std::int64_t t_k_ns) noexcept;

  CycleParts parts_;
  SessionSettings settings_;
  description::CellLimits limits_;
  std::int64_t period_ns_;
  std::int64_t receive_window_ns_;
  std::vector<Outbox> outboxes_;  // by bus; empty between cycles

  Supervisor supervisor_;
  Phase entered_phase_ = Phase::idle;
  std::int64_t phase_since_ns_ = 0;
  std::int64_t first_cycle_ns_ = 0;
  std::uint64_t cycle_ = 0;
  std::uint64_t rendered_cycles_ = 0;
  std::int64_t rendered_ns_ = 0;
  std::uint32_t missed_samples_ = 0;
  std::uint32_t overruns_in_a_row_ = 0;
  SpscRing<Change> changes_{16};
  std::vector<ScheduledChange> scheduled_;
  std::size_t next_scheduled_ = 0;
  SpscRing<Timestep> timesteps_{4};
  std::vector<ScheduledTimestep> scheduled_timesteps_;
  std::size_t next_timestep_ = 0;
  fieldbus::PeriodExchange exchange_;
  TimestepStage timestep_stage_ = TimestepStage::none;
  Timestep wanted_timestep_, old_timestep_;
  bool resumes_after_timestep_ = false;
  std::uint32_t asked_timesteps_ = 0;  // popped
  std::uint8_t rest_cycles_ = 0;
  std::atomic<double> shown_period_s_;
  std::atomic<bool> shown_change_{false};
  std::atomic<std::uint32_t> answered_timesteps_{0};
  std::atomic<bool> stop_requested_{false};
  bool stop_seen_ = false;  // in this cycle
  bool commanded_ = false;  // the guard has made this cycle's setpoints

  SpscRing<Command> commands_{16};
  std::vector<ScheduledCommand> scripted_;
  std::size_t next_scripted_ = 0;
  std::atomic<Phase> shown_phase_{Phase::idle};
  std::atomic<bool> cause_lasts_{false}, pressed_{true};  // for refusal()
  std::array<FaultReport, 8> past_faults_{};
  std::uint64_t past_fault_count_ = 0;
  bool tared_ = false;
  bool wants_resume_ = false;                                // the enabling input was pressed anew in this hold
  std::uint32_t late_score_ = 0;                             // of the sensor's samples, in sixteenths
  double force_share_ = 1.0;                                 // of the hand's force that is let in
  double speed_limit_m_per_s_;                               // of the tool
  models::Vec3 last_normal_W_ = models::Vec3::Zero();        // of the last contact; zero: there was none
  JointVector stale_cycles_;                                 // since each drive's position came
  std::array<std::uint64_t, max_buses> overflows_before_{};  // that a reset has left behind

  bool sample_is_new_ = false;
  models::Wrench reading_S_;
  models::Mat3 R_WS_ = models::Mat3::Identity();
  models::Wrench hand_W_;
  models::Vec3 tool_W_ = models::Vec3::Zero();  // by the encoders
  models::Vec3 proxy_W_ = models::Vec3::Zero();
  JointVector link_rad_;    // angles of the links at the target: what inverse kinematics starts from
  JointVector target_rad_;  // motor side, what the drives are sent
  JointVector torque_Nm_;   // the same of the impedance type
  JointVector run_out_rad_per_s_;
  JointVector measured_link_rad_;
  JointVector actual_rad_;  // by the encoders
  JointVector moved_rad_;   // per cycle, as far as the drives' answers tell
  models::Vec3 proxy_k1_W_ = models::Vec3::Zero();
  std::unique_ptr<PassivityObserver> passivity_;  // null: not wanted
  StepLimiter limiter_;
  StepLimits step_limits_;
  JointGuard guard_;
  ActiveLimits active_;
  models::ToolKinematics measured_;  // of the links, by the encoders
  models::ToolKinematics filtered_;  // of the links as they are commanded, behind the filter
  models::InverseKinematicsResult solution_;
  double run_out_scale_ = 1.0;
  double run_out_per_cycle_ = 1.0;

  std::int64_t compute_ns_ = 0;
  CycleRecord record_;
  BlackBox* box_ = nullptr;
  BoxCycle* boxed_ = nullptr;  // this cycle's entry
  SpscRing<CycleRecord> records_;
};

}  // namespace proxarm::controller
