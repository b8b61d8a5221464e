#include "controller/cycle.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fieldbus/canopen_pdo.hpp"

namespace proxarm::controller {

using models::JointVector;
using models::Vec3;

namespace {

constexpr double seconds_per_ns = 1e-9;

constexpr std::uint32_t nmt_id = 0x000;

// To what the limits as sets are solved, and more.
constexpr double leash_tolerance_m = 1e-6;

// How long the drives may take to switch off before the run ends without them.
constexpr std::int64_t disable_timeout_ns = 1'000'000'000;

std::vector<description::DriveDescription> descriptions(const CycleParts& parts) {
  std::vector<description::DriveDescription> all;
  for (const DriveOnBus& axis : parts.drives) all.push_back(axis.drive.description());
  return all;
}

// What a torque can't do, a stop does: nothing is held or slowed there.
Reactions reactions_for(const CycleParts& parts) {
  Reactions reactions = reactions_of(parts.supervision);
  if (!parts.torque) return reactions;
  for (Reaction& reaction : reactions) {
    if (reaction == Reaction::hold || reaction == Reaction::slow) reaction = Reaction::stop_1;
  }
  reactions[static_cast<std::size_t>(Fault::sensor_late)] = Reaction::carry_on;
  return reactions;
}

// By its last word, which a drive that has gone silent can't take back.
bool is_off(const DriveOnBus& axis) noexcept {
  return axis.drive.state() != fieldbus::DriveState::operation_enabled &&
         axis.drive.state() != fieldbus::DriveState::quick_stop_active;
}

}  // namespace

Cycle::Cycle(CycleParts parts, const SessionSettings& settings, const description::CellLimits& limits,
             std::size_t record_capacity)
    : parts_(std::move(parts)),
      settings_(settings),
      limits_(limits),
      period_ns_(std::llround(settings.period_s * 1e9)),
      receive_window_ns_(std::llround(receive_window * settings.period_s * 1e9)),
      outboxes_(parts_.network.bus_count()),
      supervisor_(reactions_for(parts_)),
      exchange_(parts_.can_drives),
      shown_period_s_(settings.period_s),
      speed_limit_m_per_s_(limits.max_tool_speed_m_per_s),
      stale_cycles_(JointVector::Zero(parts_.arm->axes())),
      link_rad_(parts_.arm->start_rad()),
      target_rad_(parts_.arm->start_rad()),
      torque_Nm_(JointVector::Zero(parts_.arm->axes())),
      run_out_rad_per_s_(JointVector::Zero(parts_.arm->axes())),
      measured_link_rad_(parts_.arm->start_rad()),
      actual_rad_(parts_.arm->start_rad()),
      moved_rad_(JointVector::Zero(parts_.arm->axes())),
      limiter_(descriptions(parts_), limits, settings.period_s),
      guard_(descriptions(parts_), settings.period_s),
      records_(record_capacity) {
  solution_.q = link_rad_;
  if (settings.passivity != Passivity::off) {
    passivity_ =
        std::make_unique<PassivityObserver>(PassivityConfig{}, settings.period_s, settings.passivity == Passivity::on);
  }
}

void Cycle::run_cycle(std::int64_t t_k_ns) noexcept {
  begin_box(t_k_ns);
  begin_cycle(t_k_ns);
  receive_until(t_k_ns + receive_window_ns_);
  const SteadyTime begun = std::chrono::steady_clock::now();
  measure();
  judge(t_k_ns);
  choose_targets(t_k_ns);
  send_targets(t_k_ns);
  compute_ns_ += std::chrono::nanoseconds(std::chrono::steady_clock::now() - begun).count();
  write_record(t_k_ns);
  finish_box();
  ++cycle_;
}

void Cycle::shut_down() noexcept {
  fieldbus::shut_down_drives(parts_.can_drives,
                             [this](std::size_t bus, const fieldbus::CanFrame& frame) noexcept { send(bus, frame); });
  hand_over();
}

void Cycle::begin_cycle(std::int64_t t_k_ns) noexcept {
  const SteadyTime begun = std::chrono::steady_clock::now();
  if (cycle_ == 0) {
    first_cycle_ns_ = t_k_ns;
    if (!parts_.enabling) supervisor_.handle(Event::begin);
  }
  record_ = {};
  active_ = {};
  sample_is_new_ = commanded_ = false;
  fieldbus::CanFrame frame;
  for (DriveBus& bus : parts_.drive_buses) {
    send(bus.bus, bus.sync.next());
  }
  if (parts_.sensor->poll(t_k_ns, frame)) send(parts_.sensor_bus, frame);
  hand_over();
  for (DriveOnBus& axis : parts_.drives) axis.drive.on_sync(t_k_ns);
  compute_ns_ = std::chrono::nanoseconds(std::chrono::steady_clock::now() - begun).count();
}

// What came before t_k is read with what comes.
void Cycle::receive_until(std::int64_t deadline_ns) noexcept {
  if (everything_received()) receive_all();
  while (!everything_received() && parts_.network.wait_for_frame(deadline_ns)) receive_all();
}

void Cycle::receive_all() noexcept {
  const SteadyTime begun = std::chrono::steady_clock::now();
  fieldbus::TimedFrame received;
  for (std::size_t bus = 0; bus < parts_.network.bus_count(); ++bus) {
    while (parts_.network.bus(bus).receive(received)) deliver(bus, received);
  }
  compute_ns_ += std::chrono::nanoseconds(std::chrono::steady_clock::now() - begun).count();
}

void Cycle::deliver(std::size_t bus, const fieldbus::TimedFrame& received) noexcept {
  if (box_ != nullptr) box_->add({received.frame, received.time_ns, static_cast<std::uint8_t>(bus)});
  if (bus == parts_.sensor_bus && parts_.sensor->on_frame(received.frame, received.time_ns)) return;
  for (DriveOnBus& axis : parts_.drives) {
    if (axis.bus == bus && axis.drive.on_frame(received.frame, received.time_ns)) return;
  }
  if (changing() && exchange_.on_frame(bus, received.frame)) return;
  if (parts_.enabling && parts_.enabling->on_frame(bus, received.frame, received.time_ns)) return;
  // Own frames don't come back: somebody else has sent it.
  if (is_masters_own(bus, received.frame)) {
    raise(Fault::second_master, static_cast<std::int32_t>(bus), received.frame.id);
  }
}

// NMT commands, SYNC, the controller's heartbeat and setpoints of its drives are for it alone to send.
bool Cycle::is_masters_own(std::size_t bus, const fieldbus::CanFrame& frame) const noexcept {
  if (frame.extended || frame.remote || frame.error) return false;
  const bool drives_here = std::any_of(parts_.drive_buses.begin(), parts_.drive_buses.end(),
                                       [&](const DriveBus& b) { return b.bus == bus; });
  if (!drives_here) return false;
  if (frame.id == nmt_id || frame.id == fieldbus::sync_id) return true;
  if (frame.id == fieldbus::heartbeat_id(fieldbus::DriveSettings{}.master_node)) return true;
  return std::any_of(parts_.can_drives.begin(), parts_.can_drives.end(), [&](const fieldbus::DriveSlot& slot) {
    return slot.bus == bus && frame.id == fieldbus::pdo_id(fieldbus::PdoDirection::receive, 1, slot.drive->node());
  });
}

bool Cycle::everything_received() const noexcept {
  return parts_.sensor->fresh() &&
         std::all_of(parts_.drives.begin(), parts_.drives.end(), [](const DriveOnBus& a) { return a.drive.fresh(); });
}

// Where the arm is by its encoders, and what the hand does by the sensor.
void Cycle::measure() noexcept {
  JointVector motor_rad(parts_.arm->axes());
  for (Eigen::Index i = 0; i < motor_rad.size(); ++i) {
    const fieldbus::CyclicDrive& drive = parts_.drives[i].drive;
    motor_rad[i] = drive.actual_rad();
    judge_encoder(i, motor_rad[i] - actual_rad_[i]);
    // Over two answers, where they come more seldom than cycles.
    const double T = settings_.period_s, share = T / (T + 2.0 * drive.feedback_period_s());
    moved_rad_[i] += share * (motor_rad[i] - actual_rad_[i] - moved_rad_[i]);
  }
  actual_rad_ = motor_rad;
  // Gravity twists the gears; the twist of the last cycle is right to within a cycle's change of it.
  measured_link_rad_ = motor_rad - (parts_.arm->motor_from_link(measured_link_rad_) - measured_link_rad_);
  parts_.arm->kinematics(measured_link_rad_, measured_);
  tool_W_ = measured_.X_WT.translation();
  R_WS_ = measured_.X_WS.linear();

  sample_is_new_ = parts_.sensor->fresh();
  if (sample_is_new_) {
    const fieldbus::ForceSample& sample = parts_.sensor->latest();
    reading_S_.force = Vec3(sample.wrench_S.data());
    reading_S_.torque = Vec3(sample.wrench_S.data() + 3);
  }
  hand_W_ = parts_.compensation.hand_wrench_W(reading_S_, R_WS_);
}

void Cycle::judge(std::int64_t t_k_ns) noexcept {
  stop_seen_ = stop_requested_.load(std::memory_order_relaxed);
  if (stop_seen_) supervisor_.handle(Event::stop);
  judge_enabling(t_k_ns);
  judge_buses();
  judge_drives();
  judge_sensor();
  if (overruns_in_a_row_ > settings_.max_overruns) {
    raise(Fault::overrun, -1, overruns_in_a_row_, settings_.max_overruns);
  }
  take_command(t_k_ns);
  take_timestep();
  change_timestep(t_k_ns);
  supervise_hold(t_k_ns);
  enter(supervisor_.phase(), t_k_ns);
}

void Cycle::judge_sensor() noexcept {
  missed_samples_ = sample_is_new_ ? 0 : missed_samples_ + 1;
  // The limit is three of the sensor's own samples: a third of it is one.
  judge_lateness(!telling() && missed_samples_ >= std::max(1u, settings_.max_missed_samples / 3));
  if (missed_samples_ > settings_.max_missed_samples) {
    // A counter that stands still makes each sample an old one: it is there, and frozen.
    const bool frozen = parts_.sensor->latest().repeats > settings_.max_missed_samples;
    raise(frozen ? Fault::sensor_frozen : Fault::sensor_lost, -1, missed_samples_, settings_.max_missed_samples);
  }
  if (!sample_is_new_) return;
  const fieldbus::ForceSample& sample = parts_.sensor->latest();
  if (!reading_S_.force.allFinite() || !reading_S_.torque.allFinite()) return raise(Fault::force_not_finite, -1);
  if (!sample.healthy) return raise(Fault::sensor_status, -1, sample.status);
  if (sample.saturated && needs_force()) return raise(Fault::sensor_saturated, -1);
  if (settings_.max_repeated_samples > 0 && sample.repeats > settings_.max_repeated_samples) {
    return raise(Fault::sensor_frozen, -1, sample.repeats, settings_.max_repeated_samples);
  }
  const double force_N = hand_W_.force.norm();
  if (supervisor_.phase() == Phase::rendering && force_N > limits_.max_force_N) {
    raise(Fault::force_excessive, -1, force_N, limits_.max_force_N);
  }
}

void Cycle::judge_drives() noexcept {
  if (supervisor_.phase() >= Phase::disabling) return;
  for (std::size_t i = 0; i < parts_.drives.size(); ++i) {
    const fieldbus::CyclicDrive& drive = parts_.drives[i].drive;
    const auto where = static_cast<std::int32_t>(i);
    if (drive.cycles_without_tpdo() > settings_.max_missed_feedback) {
      raise(Fault::drive_silent, where, drive.cycles_without_tpdo(), settings_.max_missed_feedback);
    } else if (!drive.fresh() && supervisor_.live() && !telling()) {  // an SDO answer may hold it up by a frame
      raise(Fault::feedback_late, where, drive.cycles_without_tpdo() + 1.0, settings_.max_missed_feedback);
    }
    switch (drive.fault()) {
      case fieldbus::DriveFault::none:
        break;
      case fieldbus::DriveFault::left_operation:
        raise(Fault::drive_disabled, where);
        break;
      case fieldbus::DriveFault::modbus_timeout:
      case fieldbus::DriveFault::modbus_closed:
        raise(Fault::modbus_silent, where);
        break;
      case fieldbus::DriveFault::target_out_of_range:
        raise(Fault::target_out_of_range, where);
        break;
      default:
        raise(Fault::drive_fault, where);
        break;
    }
  }
}

void Cycle::judge_buses() noexcept {
  for (std::size_t bus = 0; bus < parts_.network.bus_count(); ++bus) {
    const fieldbus::BusStatus& status = parts_.network.bus(bus).status();
    if (box_ != nullptr && bus < max_buses) boxed_->buses[bus] = {status.state, status.receive_overflows};
    const auto where = static_cast<std::int32_t>(bus);
    if (status.state == fieldbus::BusState::down) raise(Fault::interface_down, where);
    if (status.state == fieldbus::BusState::bus_off) raise(Fault::bus_off, where);
    if (status.state == fieldbus::BusState::error_passive) raise(Fault::error_passive, where);
    if (bus >= overflows_before_.size() || status.receive_overflows <= overflows_before_[bus]) continue;
    raise(Fault::receive_overflow, where, static_cast<double>(status.receive_overflows - overflows_before_[bus]));
    if (supervisor_.reaction(Fault::receive_overflow) < Reaction::stop_1) {
      overflows_before_[bus] = status.receive_overflows;
    }
  }
}

// What a phase does when it begins.
void Cycle::enter(Phase phase, std::int64_t t_k_ns) noexcept {
  if (phase == entered_phase_) return;
  const Phase from = entered_phase_;
  entered_phase_ = phase;
  phase_since_ns_ = t_k_ns;
  fieldbus::DriveGoal goal = fieldbus::DriveGoal::operation_enabled;
  if (phase >= Phase::disabling) goal = fieldbus::DriveGoal::switched_off;
  // Without the drive's own ramp.
  const bool at_once = supervisor_.faulted() && supervisor_.report().reaction == Reaction::stop_0;
  if (phase == Phase::disabling && at_once) goal = fieldbus::DriveGoal::none;
  for (DriveOnBus& axis : parts_.drives) axis.drive.request(goal);
  if (phase == Phase::taring) {
    for (Eigen::Index i = 0; i < target_rad_.size(); ++i) target_rad_[i] = parts_.drives[i].drive.target_rad();
  }
  if (phase == Phase::rendering || phase == Phase::freeing) start_rendering();
  // The tool may have been led into an object while nothing was rendered: slowly out of it.
  if (from == Phase::holding && phase == Phase::rendering) {
    speed_limit_m_per_s_ = std::min(speed_limit_m_per_s_, parts_.supervision.release_speed_m_per_s);
  }
  if (phase == Phase::stopping || phase == Phase::holding) start_run_out(from);
}

// A phase that begins has its say in the same cycle, so that a fault found on the way still stops on this one; unless
// the setpoints are made already: a second step of the guard would be one of twice the speed.
void Cycle::choose_targets(std::int64_t t_k_ns) noexcept {
  act(t_k_ns);
  if (supervisor_.phase() != entered_phase_) {
    enter(supervisor_.phase(), t_k_ns);
    if (!commanded_) act(t_k_ns);
  }
}

void Cycle::act(std::int64_t t_k_ns) noexcept {
  switch (supervisor_.phase()) {
    case Phase::enabling:
      await_enabled(t_k_ns);
      break;
    case Phase::taring:
      tare(t_k_ns);
      break;
    case Phase::rendering:
      render();
      break;
    case Phase::freeing:
      free_motion();
      break;
    case Phase::holding:
      take_change();
      run_out();
      break;
    case Phase::stopping:
      run_out();
      break;
    case Phase::disabling:
      await_disabled(t_k_ns);
      break;
    case Phase::idle:
      await_begin(t_k_ns);
      break;
    case Phase::faulted:
      await_reset(t_k_ns);
      break;
    case Phase::done:
      break;
  }
}

// A drive that already follows while others don't yet stays where it was told to be when it was enabled.
void Cycle::await_enabled(std::int64_t t_k_ns) noexcept {
  for (Eigen::Index i = 0; i < target_rad_.size(); ++i) target_rad_[i] = parts_.drives[i].drive.target_rad();
  if (parts_.torque) hold();
  const auto not_following = std::find_if(parts_.drives.begin(), parts_.drives.end(),
                                          [](const DriveOnBus& a) { return !a.drive.following(); });
  if (not_following == parts_.drives.end()) {
    supervisor_.handle(tared_ && !parts_.torque ? Event::reenabled : Event::enabled);
  } else if (static_cast<double>(t_k_ns - phase_since_ns_) * seconds_per_ns > settings_.enable_timeout_s) {
    raise(Fault::drive_not_enabled, static_cast<std::int32_t>(not_following - parts_.drives.begin()),
          settings_.enable_timeout_s, settings_.enable_timeout_s);
  }
}

void Cycle::await_disabled(std::int64_t t_k_ns) noexcept {
  if (!drives_off()) {
    if (t_k_ns - phase_since_ns_ <= disable_timeout_ns) return;
    const auto still_on =
        std::find_if(parts_.drives.begin(), parts_.drives.end(), [](const DriveOnBus& axis) { return !is_off(axis); });
    raise(Fault::drive_not_disabled, static_cast<std::int32_t>(still_on - parts_.drives.begin()));
  }
  const bool wait = supervisor_.faulted() && settings_.wait_after_fault_s > 0.0 && drives_off() && !stop_seen_;
  supervisor_.handle(wait && !parts_.torque ? Event::wait : Event::disabled);
}

bool Cycle::drives_off() const noexcept { return std::all_of(parts_.drives.begin(), parts_.drives.end(), is_off); }

void Cycle::tare(std::int64_t t_k_ns) noexcept {
  if (parts_.torque) hold();
  if (sample_is_new_) parts_.compensation.add_tare_sample(reading_S_, R_WS_);
  const double spread_N = parts_.compensation.tare_spread_N();
  if (spread_N > settings_.tare_spread_N) {
    raise(Fault::force_at_start, -1, spread_N, settings_.tare_spread_N);
  } else if (static_cast<double>(t_k_ns - phase_since_ns_) * seconds_per_ns >= settings_.tare_s) {
    parts_.compensation.finish_tare();
    hand_W_ = parts_.compensation.hand_wrench_W(reading_S_, R_WS_);
    tared_ = true;
    supervisor_.handle(Event::tared);
  }
}

// The proxy starts at rest where the targets stand, so the first setpoint equals the last one.
void Cycle::start_rendering() noexcept {
  if (parts_.torque) return parts_.torque->start(measured_link_rad_);
  force_share_ = 0.0;
  link_rad_ = parts_.arm->link_from_motor(target_rad_);
  const models::Pose X_WT = parts_.arm->tool_pose(link_rad_);
  parts_.elastic.start(link_rad_);
  proxy_W_ = proxy_k1_W_ = X_WT.translation();
  parts_.arm->kinematics(link_rad_, solution_.kinematics);
  guard_.start(target_rad_);
  world().start(proxy_W_);
  if (passivity_) passivity_->start(tool_W_);
  parts_.orientation.start(Eigen::Quaterniond(X_WT.linear()).normalized());
}

void Cycle::take_change() noexcept {
  Change change;
  if (next_scheduled_ < scheduled_.size() && scheduled_[next_scheduled_].rendered_ns <= rendered_ns_) {
    const double for_period_s = scheduled_[next_scheduled_].change.period_s;
    if (for_period_s != 0.0 && for_period_s != settings_.period_s && timestep_is_due())
      return;  // it was checked for that
    change = scheduled_[next_scheduled_++].change;
  } else if (!changes_.pop(change)) {
    return;
  }
  if (box_ != nullptr) boxed_->change = change;
  rest_cycles_ = 0;  // the timestep waits for those that were checked before it
  if (change.period_s == 0.0 || change.period_s == settings_.period_s) parts_.world->set(change);
}

void Cycle::render() noexcept {
  if (parts_.torque) return render_torques();
  take_change();
  make_limits();
  if (passivity_) parts_.world->add_damping(passivity_->observe_hand(hand_W_.force, tool_W_));
  ramp_in();
  const WorldStep step = parts_.world->step(force_share_ * hand_W_.force, step_limits_);
  const ProxyFault turned = parts_.orientation.step(force_share_ * hand_W_.torque);
  if (step.fault == ProxyFault::squeezed) return raise(Fault::proxy_squeezed, -1);
  if (step.fault != ProxyFault::none || turned != ProxyFault::none) return raise(Fault::proxy_not_finite, -1);
  active_.add(step.limits);
  proxy_k1_W_ = proxy_W_;
  proxy_W_ = step.q_W;
  record_world(step);
  if (passivity_) record_passivity(step);
  record_.set(RecordFlag::limit_orientation, parts_.orientation.speed_limited() || parts_.orientation.angle_limited());
  follow_proxy();
  const double distance_m = (tool_W_ - proxy_W_).norm();
  if (!(distance_m <= limits_.leash_m + leash_tolerance_m)) {
    raise(Fault::leash_exceeded, -1, distance_m, limits_.leash_m);
  }
  ++rendered_cycles_;
  rendered_ns_ += period_ns_;
}

void Cycle::record_world(const WorldStep& step) noexcept {
  record_.p_hat_W_m = triple(step.p_hat_W);
  record_.contact_force_W_N = triple(step.f_W);
  record_.normal_W = triple(step.normal_W);
  if (step.contacts > 0) last_normal_W_ = step.normal_W;
  record_.contact_object = step.object;
  record_.friction = step.friction;
  record_.proxy_mass_kg = step.mass_kg;
  record_.proxy_damping_Ns_per_m = step.damping_Ns_per_m;
  record_.contact_count = static_cast<std::uint8_t>(step.contacts);
  record_.contact = step.contacts == 0 ? ContactPhase::free : step.slips ? ContactPhase::slip : ContactPhase::stick;
}

void Cycle::record_passivity(const WorldStep& step) noexcept {
  passivity_->observe_proxy(step.v_W, step.f_W + step.limit_force_W, step.mass_kg, step.damping_Ns_per_m);
  record_.energies_J = passivity_->energies_J();
  record_.added_damping_Ns_per_m = passivity_->added_damping_Ns_per_m();
  record_.oscillation_m_per_s = passivity_->oscillation_m_per_s();
  record_.felt_damping_Ns_per_m = passivity_->felt_damping_Ns_per_m();
  record_.set(RecordFlag::oscillation, passivity_->oscillates());
}

// Where the device stands when the first brake opens.
void Cycle::hold() noexcept {
  const bool any_live = std::any_of(parts_.drives.begin(), parts_.drives.end(),
                                    [](const DriveOnBus& axis) { return axis.drive.following(); });
  if (!any_live) parts_.torque->anchor(measured_link_rad_);
  torque_Nm_ = parts_.torque->hold(measured_link_rad_).torque_Nm;
}

// A device that is driven back must not run away: it may be as fast as its joints may.
void Cycle::render_torques() noexcept {
  for (Eigen::Index i = 0; i < actual_rad_.size(); ++i) {
    const double speed = std::abs(moved_rad_[i]) / settings_.period_s;
    const double limit = parts_.drives[static_cast<std::size_t>(i)].drive.description().max_speed_rad_per_s;
    if (speed > limit) return raise(Fault::target_too_fast, static_cast<std::int32_t>(i), speed, limit);
  }
  const TorqueStep& step = parts_.torque->step(measured_link_rad_);
  if (step.world.fault != ProxyFault::none) return raise(Fault::proxy_not_finite, -1);
  active_.add(step.limits);
  proxy_W_ = step.world.q_W;
  torque_Nm_ = step.torque_Nm;
  record_world(step.world);
  ++rendered_cycles_;
  rendered_ns_ += period_ns_;
}

// The sets of this step, around the proxy and what is commanded behind the filter of the setpoints.
void Cycle::make_limits() noexcept {
  limit_speed();
  parts_.arm->kinematics(parts_.elastic.link_rad(), filtered_);
  const StepStart start{.q_k1_W = proxy_W_,
                        .q_k2_W = proxy_k1_W_,
                        .filtered_W = filtered_.X_WT.translation(),
                        .filtered_velocity_W = filtered_.J_W.topRows<3>() * parts_.elastic.link_rad_per_s(),
                        .measured_W = tool_W_,
                        .force_N = hand_W_.force.norm(),
                        .max_speed_m_per_s = speed_limit_m_per_s_};
  limiter_.make(start, link_rad_, target_rad_ - parts_.elastic.link_rad(), solution_.kinematics.J_W, step_limits_);
}

// Joint targets for the proxy's pose. Where the arm can't go all the way (a singularity, the end of its reach), the
// proxy stays where the arm is.
void Cycle::follow_proxy() noexcept {
  models::Pose X_WT = models::Pose::Identity();
  X_WT.translation() = proxy_W_;
  X_WT.linear() = parts_.orientation.R_WT().toRotationMatrix();
  const models::Vec3 reached_k1_W = solution_.kinematics.X_WT.translation();
  parts_.inverse->solve(link_rad_, X_WT, solution_);
  if (solution_.status == models::InverseKinematicsResult::Status::invalid) return raise(Fault::singular, -1);
  link_rad_ = solution_.q;
  if (solution_.status != models::InverseKinematicsResult::Status::converged) {
    active_.set(Limit::singularity);
    const models::Vec3& reached_W = solution_.kinematics.X_WT.translation();
    proxy_k1_W_ = proxy_W_ = world().resume(reached_W, (reached_W - reached_k1_W) / settings_.period_s);
  }
  command(parts_.elastic.step(link_rad_));
}

void Cycle::command(const JointVector& motor_rad) noexcept {
  JointVector wanted_rad = motor_rad;
  const std::uint8_t blocked = find_blocked(motor_rad, wanted_rad);
  active_.add(guard_.step(wanted_rad));
  commanded_ = true;
  target_rad_ = guard_.target_rad();
  if (blocked != 0 || guard_.lag_rad() > limits_.following_error_rad) wind_back(blocked);
}

// A drive that is blocked is told to go a little further than it is, not more, and all the others wait with it: so
// little is wound up that nothing snaps when it comes free. What a drive that follows is behind, after its setpoint's
// way to it and back, grows with its speed. Those that are blocked, as bits.
std::uint8_t Cycle::find_blocked(const JointVector& motor_rad, JointVector& wanted_rad) noexcept {
  std::uint8_t blocked = 0;
  for (Eigen::Index i = 0; i < motor_rad.size(); ++i) {
    const DriveOnBus& axis = parts_.drives[static_cast<std::size_t>(i)];
    if (!axis.drive.fresh()) continue;
    // On Modbus a setpoint waits for an exchange, and so does the answer.
    const double lag_s = 5.0 * settings_.period_s + 2.0 * axis.drive.feedback_period_s() +
                         1.0 / (2.0 * std::numbers::pi * axis.drive.description().position_bandwidth_Hz);
    const double room_rad = limits_.following_error_rad + lag_s / settings_.period_s * std::abs(moved_rad_[i]);
    if (std::abs(motor_rad[i] - actual_rad_[i]) <= room_rad) continue;
    blocked = static_cast<std::uint8_t>(blocked | 1u << i);
    wanted_rad[i] = std::clamp(motor_rad[i], actual_rad_[i] - room_rad, actual_rad_[i] + room_rad);
  }
  if (blocked == 0) return 0;
  active_.set(Limit::following_error, blocked);
  for (Eigen::Index i = 0; i < motor_rad.size(); ++i) {
    if ((blocked & 1u << i) == 0) wanted_rad[i] = target_rad_[i];
  }
  return blocked;
}

// Filter and proxy go on from what was commanded: nothing of what couldn't be followed is caught up later. A blocked
// joint's setpoint may have been fast, and comes to rest where it was told to.
void Cycle::wind_back(std::uint8_t blocked) noexcept {
  const JointVector& speed = guard_.speed_rad_per_s();
  guard_.follow_from_here(blocked);
  parts_.elastic.resume(target_rad_, speed);
  link_rad_ = parts_.elastic.link_rad() + parts_.elastic.lead_s() * speed;
  parts_.arm->kinematics(link_rad_, solution_.kinematics);
  const models::Vec3 velocity_W = solution_.kinematics.J_W.topRows<3>() * speed;
  proxy_W_ = world().resume(solution_.kinematics.X_WT.translation(), velocity_W);
  proxy_k1_W_ = proxy_W_ - settings_.period_s * velocity_W;
  parts_.orientation.start(Eigen::Quaterniond(solution_.kinematics.X_WT.linear()).normalized());
}

// Every joint keeps its share of the last motion while that shrinks to nothing, within each joint's deceleration.
void Cycle::run_out() noexcept {
  if (parts_.torque) {
    supervisor_.handle(Event::at_rest);
    return;
  }
  run_out_scale_ = std::max(0.0, run_out_scale_ - run_out_per_cycle_);
  active_.add(guard_.step(target_rad_ + run_out_scale_ * settings_.period_s * run_out_rad_per_s_));
  target_rad_ = guard_.target_rad();
  if (supervisor_.phase() == Phase::stopping && stands()) supervisor_.handle(Event::at_rest);
}

void Cycle::send_targets(std::int64_t t_k_ns) noexcept {
  fieldbus::CanFrame frame;
  for (std::size_t i = 0; i < parts_.drives.size(); ++i) {
    fieldbus::CyclicDrive& drive = parts_.drives[i].drive;
    if (parts_.torque) {
      parts_.can_drives[i].drive->set_target_torque_Nm(torque_Nm_[static_cast<Eigen::Index>(i)]);
    } else {
      drive.set_target_rad(target_rad_[static_cast<Eigen::Index>(i)]);
    }
    if (drive.encode_rpdo(frame)) send(parts_.drives[i].bus, frame);
  }
  for (DriveBus& bus : parts_.drive_buses) {
    if (bus.heartbeat.due(t_k_ns, cycle_, frame)) send(bus.bus, frame);
  }
  if (changing()) send_period_requests(t_k_ns);
  hand_over();
}

// Leaves with the next hand_over(), in one call with the bus' others.
void Cycle::send(std::size_t bus, const fieldbus::CanFrame& frame) noexcept {
  Outbox& outbox = outboxes_[bus];
  if (outbox.count == outbox.frames.size()) hand_over(bus);
  outbox.frames[outbox.count++] = frame;
}

void Cycle::hand_over() noexcept {
  for (std::size_t bus = 0; bus < outboxes_.size(); ++bus) {
    if (outboxes_[bus].count > 0) hand_over(bus);
  }
}

void Cycle::hand_over(std::size_t bus) noexcept {
  Outbox& outbox = outboxes_[bus];
  std::array<fieldbus::SendResult, std::tuple_size_v<decltype(Outbox::frames)>> results{};
  parts_.network.bus(bus).send_all({outbox.frames.data(), outbox.count}, results.data());
  const std::int64_t now_ns = box_ == nullptr ? 0 : parts_.network.now_ns();
  for (std::size_t i = 0; i < outbox.count; ++i) {
    if (box_ != nullptr) box_->add({outbox.frames[i], now_ns, static_cast<std::uint8_t>(bus), true, results[i]});
    if (results[i] == fieldbus::SendResult::sent) continue;
    const auto where = static_cast<std::int32_t>(bus);
    raise(results[i] == fieldbus::SendResult::bus_off ? Fault::bus_off
          : results[i] == fieldbus::SendResult::down  ? Fault::interface_down
                                                      : Fault::send_failed,
          where);
  }
  outbox.count = 0;
}

void Cycle::raise(Fault fault, std::int32_t where, double value, double limit) noexcept {
  // What would hold the arm is for a person to go on from.
  if (changing() && supervisor_.reaction(fault) == Reaction::hold) resumes_after_timestep_ = false;
  supervisor_.raise({fault, where, cycle_, value, limit});
}

void Cycle::write_record(std::int64_t t_k_ns) noexcept {
  record_.cycle = cycle_;
  record_.time_ns = t_k_ns - first_cycle_ns_;
  record_.period_ns = period_ns_;
  record_.phase = entered_phase_;
  record_.axes = static_cast<std::uint8_t>(parts_.drives.size());
  record_.set(RecordFlag::sample_held, !sample_is_new_);
  record_.set(RecordFlag::overrun, overruns_in_a_row_ > 0);
  for (const LimitFlag& flag : limit_flags) record_.set(flag.flag, active_.has(flag.limit));
  record_.limited_axes = active_.axes;
  record_.force_S_N = triple(reading_S_.force);
  record_.torque_S_Nm = triple(reading_S_.torque);
  record_.force_W_N = triple(hand_W_.force);
  record_.torque_W_Nm = triple(hand_W_.torque);
  record_.proxy_W_m = triple(proxy_W_);
  record_.tool_W_m = triple(tool_W_);
  for (std::size_t i = 0; i < parts_.drives.size(); ++i) {
    const fieldbus::CyclicDrive& drive = parts_.drives[i].drive;
    record_.target_counts[i] = parts_.torque ? parts_.can_drives[i].drive->target_torque() : drive.target_counts();
    record_.actual_counts[i] = drive.actual_counts();
    if (!drive.fresh()) record_.set(RecordFlag::feedback_missing);
  }
  record_.compute_ns = compute_ns_;
  record_.set(RecordFlag::timestep, changing());
  shown_phase_.store(supervisor_.phase(), std::memory_order_relaxed);
  shown_period_s_.store(settings_.period_s, std::memory_order_relaxed);
  shown_change_.store(changing(), std::memory_order_relaxed);
  if (!changing() || timestep_stage_ == TimestepStage::unknown) {
    answered_timesteps_.store(asked_timesteps_, std::memory_order_release);
  }
  pressed_.store(!parts_.enabling || parts_.enabling->pressed(), std::memory_order_relaxed);
  cause_lasts_.store(!may_move(), std::memory_order_relaxed);
  records_.push(record_);
}

void Cycle::begin_box(std::int64_t t_k_ns) noexcept {
  if (box_ == nullptr) return;
  if (const std::span<std::byte> room = box_->state_room(); !room.empty()) {
    fieldbus::StateArchive state = fieldbus::StateArchive::writer(room);
    archive(state);
    if (state.whole()) box_->finish_state(state.bytes());
  }
  boxed_ = &box_->begin(t_k_ns);
}

void Cycle::finish_box() noexcept {
  if (box_ == nullptr) return;
  boxed_->overruns_in_a_row = overruns_in_a_row_;
  boxed_->stop_requested = stop_seen_;
  fieldbus::StateArchive inputs = fieldbus::StateArchive::writer(boxed_->inputs);
  for (DriveOnBus& axis : parts_.drives) axis.drive.archive_input(inputs);
  parts_.sensor->archive_input(inputs);
  boxed_->input_bytes = static_cast<std::uint16_t>(inputs.bytes());
  boxed_->rendered_ns = rendered_ns_;
  boxed_->record = record_;
  box_->finish();
}

void Cycle::archive(fieldbus::StateArchive& state) noexcept {
  for (DriveOnBus& axis : parts_.drives) axis.drive.archive(state);
  for (DriveBus& bus : parts_.drive_buses) state(bus.sync, bus.heartbeat);
  parts_.sensor->archive(state);
  if (parts_.torque) parts_.torque->archive(state);
  if (parts_.world) parts_.world->archive(state);
  if (passivity_) passivity_->archive(state);
  if (parts_.enabling) parts_.enabling->archive(state);
  if (parts_.freeing) parts_.freeing->archive(state);
  archive_timestep(state);
  state(parts_.elastic, parts_.orientation, parts_.compensation, supervisor_, entered_phase_, phase_since_ns_,
        first_cycle_ns_, cycle_, rendered_cycles_, rendered_ns_, missed_samples_, reading_S_.force, reading_S_.torque,
        R_WS_, hand_W_.force, hand_W_.torque, tool_W_, proxy_W_, proxy_k1_W_, link_rad_, target_rad_, torque_Nm_,
        run_out_rad_per_s_, measured_link_rad_, actual_rad_, moved_rad_, guard_, run_out_scale_, run_out_per_cycle_,
        tared_, wants_resume_, late_score_, force_share_, speed_limit_m_per_s_, last_normal_W_, stale_cycles_,
        overflows_before_);
  if (state.reading()) parts_.arm->kinematics(link_rad_, solution_.kinematics);
}

}  // namespace proxarm::controller
