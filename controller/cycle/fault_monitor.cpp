#include "controller/cycle/fault_monitor.hpp"

#include "fieldbus/sensors/channel_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace proxarm::controller {
namespace {

constexpr std::uint32_t late_sample = 16, late_limit = 8 * late_sample;
// Factor by which an encoder may seem faster than its joint's speed limit. Oscillating gears make an encoder only
// slightly faster than the limit.
constexpr double implausible_speeds = 4.0;

// Whether the drive gives torque, to follow setpoints or to brake by itself.
bool has_power(fieldbus::DriveState state) noexcept {
  return state == fieldbus::DriveState::operation_enabled || state == fieldbus::DriveState::quick_stop_active ||
         state == fieldbus::DriveState::fault_reaction_active;
}

bool is_faulty(fieldbus::DriveState state) noexcept {
  return state == fieldbus::DriveState::fault || state == fieldbus::DriveState::fault_reaction_active;
}

std::uint8_t bit_of(std::size_t drive) noexcept { return static_cast<std::uint8_t>(1u << drive); }

}  // namespace

void FaultMonitor::judge_encoders(const Measured& measured, Phase entered) noexcept {
  // When power has been cut, further faults can't change anything, so they aren't judged.
  const bool cut = entered == Phase::disabling && supervisor_.cuts_power();
  const Phase judged = cut ? Phase::faulted : entered;
  judge_joints(measured, judged);
  judge_following(measured, judged);
  judge_tool(measured, judged);
}

void FaultMonitor::judge_joints(const Measured& measured, Phase entered) noexcept {
  if (entered < Phase::taring || entered > Phase::disabling) return;
  for (Eigen::Index i = 0; i < measured.axes(); ++i) {
    const fieldbus::CyclicDrive& drive = drives_[static_cast<std::size_t>(i)].drive;
    if ((measured.fresh & 1u << i) == 0 || (entered == Phase::disabling && !has_power(drive.state()))) continue;
    const double T = settings_.period_s;
    const double cycles = 1.0 + measured.answers.unheard_cycles[i] + 2.0 * measured.answers.period_s[i] / T;
    const double most_rad = implausible_speeds * drive.description().max_speed_rad_per_s * T * cycles;
    const double jump_rad = std::abs(measured.jump_rad[i]);
    if (jump_rad > most_rad) {
      alarm_.raise(Fault::position_implausible, static_cast<std::int32_t>(i), jump_rad, most_rad);
    }
  }
}

// Judges whether drives follow. A drive is judged while it reports that it has power. A drive that takes no setpoints
// counts as braking by itself.
void FaultMonitor::judge_following(const Measured& measured, Phase entered) noexcept {
  if (!drives_follow_) return;
  std::uint8_t following = 0, braking = 0;
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    if (entered < Phase::enabling || entered > Phase::disabling || !has_power(drives_[i].drive.state())) continue;
    const bool follows = entered != Phase::disabling && (measured.following & bit_of(i)) != 0;
    (follows ? following : braking) |= bit_of(i);
  }
  const DriveReports now{.reported_rad = measured.motor_rad,
                         .link_rad = measured.link_rad,
                         .setpoint_rad = measured.drive_target_rad,
                         .feedback_period_s = measured.answers.period_s,
                         .fresh = measured.fresh,
                         .following = following,
                         .braking = braking,
                         .hand_W = measured.hand_W};
  const bool waits = entered == Phase::rendering || entered == Phase::freeing;
  const DriveVerdict verdict = drives_follow_->step(now, waits, settings_.period_s);
  if (verdict.fault != Fault::none) alarm_.raise(verdict.fault, verdict.joint, verdict.value_rad, verdict.limit_rad);
}

void FaultMonitor::judge_tool(const Measured& measured, Phase entered) noexcept {
  if (!tool_) return;
  if (entered < Phase::taring || entered > Phase::disabling) return tool_->start();
  // Without power, only brakes hold the arm, so the controller can't influence the tool's motion.
  if (entered == Phase::disabling && !any_has_power()) return tool_->start();
  const ToolVerdict verdict = tool_->step(measured.tool_W, measured.elbow_moved_m, settings_.period_s);
  if (verdict.fault != Fault::none) alarm_.raise(verdict.fault, -1, verdict.value, verdict.limit);
}

bool FaultMonitor::any_has_power() const noexcept {
  return std::any_of(drives_.begin(), drives_.end(), [](const DriveOnBus& d) { return has_power(d.drive.state()); });
}

void FaultMonitor::judge(const JudgedCycle& cycle) noexcept {
  // After a gap in the loop's cycles, drives and sensor are silent or stopped as well. The gap is the cause, so its
  // fault is raised first.
  if (cycle.overruns_in_a_row > settings_.max_overruns) {
    alarm_.raise(Fault::overrun, -1, cycle.overruns_in_a_row, settings_.max_overruns);
  }
  judge_enabling(cycle.enabling);
  judge_start(cycle);
  judge_standstill(cycle);
  judge_buses(cycle.buses);
  judge_drives(cycle.telling);
  judge_sensor(cycle);
}

void FaultMonitor::judge_enabling(const EnablingInput* enabling) noexcept {
  if (enabling == nullptr || enabling->pressed()) return;
  const Phase phase = supervisor_.phase();
  if (supervisor_.live() || phase == Phase::enabling || phase == Phase::taring) {
    alarm_.raise(enabling->squeezed() ? Fault::enabling_squeezed : Fault::enabling_released);
  }
}

// Judges at the first enabling whether each joint is within its range. A drive is enabled state by state, so it reports
// its position before it has power.
void FaultMonitor::judge_start(const JudgedCycle& cycle) noexcept {
  if (cycle.tared || supervisor_.phase() > Phase::taring) return;
  for (Eigen::Index i = 0; i < cycle.measured.axes(); ++i) {
    if ((cycle.measured.fresh & 1u << i) == 0) continue;
    const double angle_rad = cycle.measured.motor_rad[i];
    const auto [low, high] = drives_[static_cast<std::size_t>(i)].drive.description().range_rad;
    if (angle_rad >= low - bounds_.beyond_range_rad && angle_rad <= high + bounds_.beyond_range_rad) continue;
    alarm_.raise(Fault::joint_out_of_range, static_cast<std::int32_t>(i), angle_rad, angle_rad < low ? low : high);
  }
}

void FaultMonitor::judge_standstill(const JudgedCycle& cycle) noexcept {
  if (!standstill_) return;
  const Measured& measured = cycle.measured;
  const StandstillVerdict verdict =
      standstill_->step(measured.motor_rad, measured.fresh, cycle.stands, settings_.period_s);
  if (verdict.fault != Fault::none) alarm_.raise(verdict.fault, verdict.joint, verdict.value_rad, verdict.limit_rad);
}

void FaultMonitor::judge_buses(std::span<const fieldbus::BusStatus> buses) noexcept {
  for (std::size_t bus = 0; bus < buses.size(); ++bus) {
    const fieldbus::BusStatus& status = buses[bus];
    const auto where = static_cast<std::int32_t>(bus);
    if (status.state == fieldbus::BusState::down) alarm_.raise(Fault::interface_down, where);
    if (status.state == fieldbus::BusState::bus_off) alarm_.raise(Fault::bus_off, where);
    if (status.state == fieldbus::BusState::error_passive) alarm_.raise(Fault::error_passive, where);
    if (bus >= max_buses || status.receive_overflows <= state_.overflows_before[bus]) continue;
    const std::uint64_t lost = status.receive_overflows - state_.overflows_before[bus];
    alarm_.raise(Fault::receive_overflow, where, static_cast<double>(lost));
    if (supervisor_.reaction(Fault::receive_overflow) < Reaction::stop_1) {
      state_.overflows_before[bus] = status.receive_overflows;
    }
  }
}

void FaultMonitor::judge_drives(bool telling) noexcept {
  if (supervisor_.phase() > Phase::disabling) return;
  if (supervisor_.phase() == Phase::disabling) return judge_switching_off();
  state_.faulty = 0;
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    const fieldbus::CyclicDrive& drive = drives_[i].drive;
    const auto where = static_cast<std::int32_t>(i);
    if (drive.cycles_without_tpdo() > settings_.max_missed_feedback) {
      alarm_.raise(Fault::drive_silent, where, drive.cycles_without_tpdo(), settings_.max_missed_feedback);
    } else if (!drive.fresh() && supervisor_.live() && !telling) {
      alarm_.raise(Fault::feedback_late, where, drive.cycles_without_tpdo() + 1.0, settings_.max_missed_feedback);
    }
    judge_drive_fault(where, drive.fault());
    if (is_faulty(drive.state())) state_.faulty |= bit_of(i);
  }
}

// While drives switch off, they may become silent or leave operation enabled. Only a fault that a drive reports counts.
void FaultMonitor::judge_switching_off() noexcept {
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    if (!is_faulty(drives_[i].drive.state()) || (state_.faulty & bit_of(i)) != 0) continue;
    state_.faulty |= bit_of(i);
    if (!supervisor_.cuts_power()) alarm_.raise(Fault::drive_fault, static_cast<std::int32_t>(i));
  }
}

void FaultMonitor::judge_drive_fault(std::int32_t where, fieldbus::DriveFault fault) noexcept {
  switch (fault) {
    case fieldbus::DriveFault::none:
      return;
    case fieldbus::DriveFault::left_operation:
      return alarm_.raise(Fault::drive_disabled, where);
    case fieldbus::DriveFault::modbus_timeout:
    case fieldbus::DriveFault::modbus_closed:
      return alarm_.raise(Fault::modbus_silent, where);
    case fieldbus::DriveFault::target_out_of_range:
      return alarm_.raise(Fault::target_out_of_range, where);
    default:
      return alarm_.raise(Fault::drive_fault, where);
  }
}

void FaultMonitor::judge_sensor(const JudgedCycle& cycle) noexcept {
  const std::uint32_t most = settings_.max_missed_samples;
  state_.missed_samples = cycle.measured.sample_is_new ? 0 : state_.missed_samples + 1;
  judge_lateness(!cycle.telling && state_.missed_samples >= std::max(1u, most / 3));
  if (state_.missed_samples > most) {
    // If the sensor's counter stands still, no sample counts as new: the sensor answers, but is frozen.
    const bool frozen = cycle.sample.repeats > most;
    alarm_.raise(frozen ? Fault::sensor_frozen : Fault::sensor_lost, -1, state_.missed_samples, most);
  }
  if (cycle.measured.sample_is_new) judge_sample(cycle);
  judge_jump(cycle);
}

// Judges jumps of the force in all phases in which the hand's force moves the arm.
void FaultMonitor::judge_jump(const JudgedCycle& cycle) noexcept {
  const Measured& measured = cycle.measured;
  state_.since_sample_s += settings_.period_s;
  if (!measured.sample_is_new) return;
  const double since_s = std::exchange(state_.since_sample_s, 0.0);
  const Phase phase = supervisor_.phase();
  const bool follows = phase == Phase::rendering || (phase == Phase::freeing && !cycle.backs_off);
  if (!cycle.load_S || !follows) return jump_.start();
  const LoadSample sample{.load_S = *cycle.load_S,
                          .hand_S = measured.R_WS.transpose() * measured.hand_W.force,
                          .beside_zero_S = measured.bias.beside_zero_S,
                          .noise_N = measured.bias.noise_N,
                          .since_s = since_s,
                          .usual_s = measured.bias.sample_cycles * settings_.period_s};
  if (jump_.step(sample)) alarm_.raise(Fault::force_jumped, -1, jump_.jump_N(), jump_.limit_N());
}

void FaultMonitor::judge_sample(const JudgedCycle& cycle) noexcept {
  const Measured& measured = cycle.measured;
  const fieldbus::ForceSample& sample = cycle.sample;
  if (!measured.reading_S.force.allFinite() || !measured.reading_S.torque.allFinite()) {
    return alarm_.raise(Fault::force_not_finite);
  }
  if (!sample.healthy) return alarm_.raise(Fault::sensor_status, -1, sample.status);
  if (sample.saturated && needs_force(cycle)) return alarm_.raise(Fault::sensor_saturated);
  if (settings_.max_repeated_samples > 0 && sample.repeats > settings_.max_repeated_samples) {
    return alarm_.raise(Fault::sensor_frozen, -1, sample.repeats, settings_.max_repeated_samples);
  }
  // A saturated gauge repeats its largest reading without being stuck. In a hold it isn't a fault, since the force
  // isn't needed.
  if (settings_.max_repeated_samples > 0 && !sample.saturated &&
      sample.channel_repeats > fieldbus::ChannelWatch::most_repeats) {
    return alarm_.raise(Fault::sensor_frozen, -1, sample.channel_repeats, fieldbus::ChannelWatch::most_repeats);
  }
  const double force_N = measured.hand_W.force.norm();
  if (supervisor_.phase() != Phase::rendering) return;
  if (force_N > bounds_.max_force_N) alarm_.raise(Fault::force_excessive, -1, force_N, bounds_.max_force_N);
  const double drift_N = measured.bias.drift_N;
  if (drift_N > bounds_.max_bias_drift_N) alarm_.raise(Fault::sensor_drifts, -1, drift_N, bounds_.max_bias_drift_N);
}

// Whether the force is needed now. A person who is pinned may saturate a strain gauge. Three phases don't need the
// force, so they continue: a hold, enabling before a hold, and backing off.
bool FaultMonitor::needs_force(const JudgedCycle& cycle) const noexcept {
  switch (supervisor_.phase()) {
    case Phase::holding:
      return false;
    case Phase::enabling:
      return !cycle.tared;
    case Phase::freeing:
      return !cycle.backs_off;
    default:
      return true;
  }
}

void FaultMonitor::judge_lateness(bool late) noexcept {
  std::uint32_t& score = state_.late_score;
  if (late) {
    score += late_sample;
  } else if (score > 0) {
    --score;
  }
  score = std::min(score, 2 * late_limit);
  if (!supervisor_.live() || score <= late_limit) return;
  constexpr double samples = 1.0 / late_sample;
  alarm_.raise(Fault::sensor_late, -1, samples * score, samples * late_limit);
}

void FaultMonitor::forget(std::span<const fieldbus::BusStatus> buses) noexcept {
  state_.missed_samples = state_.late_score = 0;
  for (std::size_t bus = 0; bus < std::min(max_buses, buses.size()); ++bus) {
    state_.overflows_before[bus] = buses[bus].receive_overflows;
  }
}

}  // namespace proxarm::controller
