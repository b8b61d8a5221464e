#include "controller/cycle/cycle.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace proxarm::controller {
namespace {

bool renders_torques(const CycleParts& parts) noexcept {
  return std::holds_alternative<std::unique_ptr<TorqueRendering>>(parts.rendering);
}

// A joint that a fault has stopped at the end of its range is beyond this end by at most the deviation that the fault
// drive_deviates allows.
ReadingBounds reading_bounds(const CycleParts& parts, const description::CellLimits& limits) noexcept {
  return {.max_force_N = limits.max_force_N,
          .max_bias_drift_N = parts.supervision.max_bias_drift_N,
          .beyond_range_rad = away_at_once * limits.following_error_rad,
          .max_force_step_N = parts.supervision.max_force_step_N,
          .handle_S = parts.compensation.tool().handle_S};
}

// If the drives take torques, a hand may move the device at any speed, so the tool's speed isn't monitored.
std::optional<ToolMonitor> tool_monitor(const CycleParts& parts, const SessionSettings& settings,
                                        const description::CellLimits& limits) {
  if (renders_torques(parts)) return {};
  double feedback_s = 0.0;
  for (const DriveOnBus& axis : parts.drives) feedback_s = std::max(feedback_s, axis.drive.feedback_period_s());
  return ToolMonitor(limits, settings.max_missed_feedback, feedback_s);
}

std::optional<DriveMonitor> drive_monitor(const CycleParts& parts, const description::CellLimits& limits) {
  if (renders_torques(parts)) return {};
  std::vector<description::DriveDescription> drives;
  for (const DriveOnBus& axis : parts.drives) drives.push_back(axis.drive.description());
  return DriveMonitor(*parts.arm, std::move(drives), limits.following_error_rad);
}

std::optional<StandstillMonitor> standstill_monitor(const CycleParts& parts, const description::CellLimits& limits) {
  if (!parts.supervision.monitored_standstill || renders_torques(parts)) return {};
  return StandstillMonitor(parts.arm->axes(), limits.following_error_rad);
}

// Returns the reactions to faults. If the drives take torques, the arm can't be held or slowed, so the reactions `hold`
// and `slow` become stops.
Reactions reactions_for(const CycleParts& parts) {
  Reactions reactions = reactions_of(parts.supervision);
  if (!renders_torques(parts)) return reactions;
  for (Reaction& reaction : reactions) {
    if (reaction == Reaction::hold || reaction == Reaction::slow) reaction = Reaction::stop_1;
  }
  reactions[static_cast<std::size_t>(Fault::sensor_late)] = Reaction::carry_on;
  return reactions;
}

// Returns the reason why this session keeps its timestep, or nullptr if the timestep can change.
const char* fixed_timestep(const CycleParts& parts) noexcept {
  if (renders_torques(parts)) return "the impedance type's torques are made for one timestep";
  if (!parts.modbus_lines.empty()) return "what is on a Modbus line keeps the timestep of the start";
  return nullptr;
}

}  // namespace

Cycle::Cycle(CycleParts parts, const SessionSettings& settings, const description::CellLimits& limits,
             std::size_t record_capacity)
    : parts_(std::move(parts)),
      settings_(settings),
      status_(settings.period_s, fixed_timestep(parts_)),
      supervisor_(reactions_for(parts_)),
      alarm_(supervisor_, state_.cycle),
      recorder_(record_capacity),
      bus_(parts_, recorder_, alarm_),
      measurement_(parts_.drives, *parts_.sensor, *parts_.arm, parts_.compensation, settings.period_s),
      faults_(parts_.drives, settings_, reading_bounds(parts_, limits), supervisor_, alarm_,
              tool_monitor(parts_, settings, limits), drive_monitor(parts_, limits),
              standstill_monitor(parts_, limits)),
      motion_(make_motion(parts_, settings, limits)),
      timestep_(parts_.can_drives),
      tool_(parts_.tool) {}

void Cycle::run_cycle(std::int64_t t_k_ns) noexcept {
  const ComputeTime timed(parts_.network);
  begin_cycle(t_k_ns);
  bus_.receive_until(t_k_ns + std::llround(settings_.receive_window * settings_.period_s * 1e9), timestep_);
  measure();
  judge(t_k_ns);
  choose_setpoints(t_k_ns);
  send_setpoints(t_k_ns);
  write_record(t_k_ns);
  end_cycle(timed);
}

void Cycle::begin_cycle(std::int64_t t_k_ns) noexcept {
  recorder_.begin(t_k_ns, [this](fieldbus::StateArchive& state) noexcept { archive(state); });
  if (state_.cycle == 0) {
    state_.first_cycle_ns = t_k_ns;
    if (!parts_.enabling) supervisor_.handle(Event::begin);
  }
  motion_->begin_cycle();
  bus_.begin(t_k_ns);
}

void Cycle::measure() noexcept {
  fade_tool();
  measurement_.take();
  faults_.judge_encoders(measurement_.now(), state_.entered_phase);
}

void Cycle::judge(std::int64_t t_k_ns) noexcept {
  recorder_.entry().stop_requested = status_.stop_requested();
  if (recorder_.entry().stop_requested) supervisor_.handle(Event::stop);
  heed_enabling_input(t_k_ns);
  faults_.judge({.measured = measurement_.now(),
                 .sample = parts_.sensor->latest(),
                 .enabling = parts_.enabling ? &*parts_.enabling : nullptr,
                 .buses = bus_.read_status(),
                 .overruns_in_a_row = overruns_in_a_row_,
                 .telling = timestep_.telling(),
                 .tared = state_.tared,
                 .stands = stands_in_hold() || state_.entered_phase == Phase::taring,
                 .backs_off = motion_->backs_off(),
                 .load_S = measurement_.compensation().load_S(measurement_.now().reading_S)});
  take_command(t_k_ns);
  take_timestep();
  change_timestep(t_k_ns);
  supervise_hold(t_k_ns);
  enter(supervisor_.phase(), t_k_ns);
}

// If the phase changes while setpoints are chosen, the new phase acts in this cycle, too, unless this cycle's setpoints
// have been made. So a fault that is found while setpoints are chosen stops the arm at once.
void Cycle::choose_setpoints(std::int64_t t_k_ns) noexcept {
  act(t_k_ns);
  if (supervisor_.phase() == state_.entered_phase) return;
  enter(supervisor_.phase(), t_k_ns);
  if (!motion_->made_setpoints()) act(t_k_ns);
}

void Cycle::send_setpoints(std::int64_t t_k_ns) noexcept {
  bus_.send_setpoints(motion_->setpoints(), t_k_ns, state_.cycle);
  fieldbus::CanFrame frame;
  std::size_t bus = 0;
  while (timestep_.next_request(t_k_ns, bus, frame)) bus_.send(bus, frame);
  bus_.hand_over();
}

void Cycle::write_record(std::int64_t t_k_ns) noexcept {
  CycleRecord& record = recorder_.record();
  const Measured& measured = measurement_.now();
  record.cycle = state_.cycle;
  record.time_ns = t_k_ns - state_.first_cycle_ns;
  record.period_ns = period_ns();
  record.phase = state_.entered_phase;
  record.set(RecordFlag::sample_held, !measured.sample_is_new);
  record.set(RecordFlag::sample_late, measured.sample_is_new && parts_.sensor->latest().late);
  record.set(RecordFlag::overrun, overruns_in_a_row_ > 0 || was_waited_for_);
  record.set(RecordFlag::timestep, timestep_.under_way());
  record.set(RecordFlag::power_cut, supervisor_.cuts_power());
  for (const LimitFlag& flag : limit_flags) record.set(flag.flag, motion_->active().has(flag.limit));
  record.limited_joints = motion_->active().joints;
  record.fault = supervisor_.report().fault;
  if (state_.entered_phase == Phase::holding) record.held_for = supervisor_.held_for().fault;
  const FaultReport& report = record.fault != Fault::none ? supervisor_.report() : supervisor_.held_for();
  record.fault_where = report.where;
  record.fault_cycle = report.cycle;
  record.fault_value = report.value;
  record.fault_limit = report.limit;
  record.force_S_N = triple(measured.reading_S.force);
  record.torque_S_Nm = triple(measured.reading_S.torque);
  record.force_W_N = triple(measured.hand_W.force);
  record.torque_W_Nm = triple(measured.hand_W.torque);
  record.proxy_W_m = triple(motion_->proxy_W());
  record.tool_mass_kg = tool_.wanted().mass_kg;
  const Eigen::Quaterniond R_WT = motion_->proxy_R_WT();
  record.proxy_q_W = {R_WT.x(), R_WT.y(), R_WT.z(), R_WT.w()};
  record.tool_W_m = triple(measured.tool_W);
  bus_.write_record(record);
}

void Cycle::end_cycle(const ComputeTime& timed) noexcept {
  BoxCycle& entry = recorder_.entry();
  entry.overruns_in_a_row = overruns_in_a_row_;
  entry.rendered_ns = state_.rendered_ns;
  bus_.write_inputs(entry);
  status_.show({.phase = supervisor_.phase(),
                .period_s = settings_.period_s,
                .changes_timestep = timestep_.under_way(),
                .pressed = !parts_.enabling || parts_.enabling->pressed(),
                .cause_lasts = !may_move(),
                .timesteps_answered = timestep_.settled(),
                .asked_timesteps = requests_.timesteps.taken_from_thread(),
                .tool = measurement_.tool_evidence(tool_.wanted(), settings_)});
  recorder_.record().compute_ns = timed.ns();  // doesn't include the copying of the record into the rings
  recorder_.finish();
  ++state_.cycle;
}

// Changes the timestep: recomputes values that depend on T, and converts times that are counted in cycles. Setpoints,
// measurements and proxy don't change. Precondition: the arm stands.
void Cycle::apply(const Timestep& timestep) noexcept {
  const double ratio = settings_.period_s / timestep.period_s;
  settings_.max_missed_samples = timestep.max_missed_samples;
  settings_.max_repeated_samples = timestep.max_repeated_samples;
  settings_.period_s = timestep.period_s;
  if (ratio != 1.0) supervisor_.rescale(state_.cycle, ratio);
  measurement_.set_period(timestep.period_s);
  motion_->set_period(timestep.period_s);
  look_ahead(timestep.horizon_s);
}

// Sets the lookahead's horizon. If horizon_s is negative, the present horizon stays.
void Cycle::look_ahead(double horizon_s) noexcept {
  if (!(horizon_s >= 0.0)) return;
  settings_.horizon_s = horizon_s;
  motion_->set({.parameter = Parameter::lookahead, .value = horizon_s});
}

// The timestep is archived first, since everything archived after it depends on it.
void Cycle::archive(fieldbus::StateArchive& state) noexcept {
  Timestep now = timestep_of(settings_);
  archive_fields(state, now);
  if (state.reading() && plausible(now)) apply(now);
  tool_.archive(state);
  if (state.reading()) carry_tool();
  bus_.archive(state);
  if (parts_.enabling) parts_.enabling->archive(state);
  archive_fields(state, state_);
  state(supervisor_, alarm_, measurement_, faults_, *motion_, timestep_);
}

}  // namespace proxarm::controller
