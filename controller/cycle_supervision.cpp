// The cycle's part of the supervision: the enabling input, holds and what leads out of them, commands, resets.
#include <algorithm>
#include <cmath>

#include "controller/cycle.hpp"

namespace proxarm::controller {

using models::JointVector;
using models::Vec3;

namespace {

constexpr double seconds_per_ns = 1e-9;

// Without what it was held for, before rendering may go on; and before a speed limit is lifted again.
constexpr double clear_of_cause_s = 0.1, clear_of_slow_s = 0.5;
// By which the tool's speed limit goes down and up, at most a quarter of the acceleration that the cell allows: so that
// the sets of speed and acceleration always have points in common.
constexpr double speed_limit_m_per_s2 = 1.0;
// A score of sixteenths: each late sample adds 16, each in time takes 1. Above eight, more than one in 17 is late.
constexpr std::uint32_t late_sample = 16, late_limit = 8 * late_sample;
// How much faster than its joint an encoder may seem to be; gears that ring make it a little faster.
constexpr double implausible_speeds = 4.0;
// The hand's force that shows where to back off to, where nothing was touched.
constexpr double pinning_force_N = 5.0;

double since_s(std::int64_t t_k_ns, std::int64_t begin_ns) noexcept {
  return static_cast<double>(t_k_ns - begin_ns) * seconds_per_ns;
}

std::uint64_t cycles_of(double time_s, double period_s) noexcept {
  return static_cast<std::uint64_t>(std::ceil(time_s / period_s));
}

}  // namespace

void Cycle::judge_enabling(std::int64_t t_k_ns) noexcept {
  if (!parts_.enabling) return;
  parts_.enabling->on_cycle(t_k_ns);
  const bool pressed = parts_.enabling->pressed(), anew = parts_.enabling->take_press();
  const Phase phase = supervisor_.phase();
  if (!pressed) wants_resume_ = resumes_after_timestep_ = false;
  if (phase == Phase::idle && anew) supervisor_.handle(Event::begin);
  if (phase == Phase::holding && anew) wants_resume_ = true;
  if (!pressed && (supervisor_.live() || phase == Phase::enabling || phase == Phase::taring)) {
    raise(Fault::enabling_released, -1);
  }
}

void Cycle::await_begin(std::int64_t t_k_ns) noexcept {
  if (since_s(t_k_ns, first_cycle_ns_) > settings_.enabling_timeout_s) raise(Fault::enabling_not_pressed, -1);
}

// An encoder can't be where its joint can't have come to since it was last heard.
void Cycle::judge_encoder(Eigen::Index axis, double moved_rad) noexcept {
  const fieldbus::CyclicDrive& drive = parts_.drives[static_cast<std::size_t>(axis)].drive;
  if (!drive.fresh()) {
    stale_cycles_[axis] += 1.0;
    return;
  }
  const double cycles = 1.0 + stale_cycles_[axis] + 2.0 * drive.feedback_period_s() / settings_.period_s;
  const double most_rad = implausible_speeds * drive.description().max_speed_rad_per_s * settings_.period_s * cycles;
  stale_cycles_[axis] = 0.0;
  if (entered_phase_ < Phase::taring || entered_phase_ > Phase::stopping) return;
  if (std::abs(moved_rad) > most_rad) {
    raise(Fault::position_implausible, static_cast<std::int32_t>(axis), std::abs(moved_rad), most_rad);
  }
}

// A person who is pinned may press a gauge to its rail: a hold, and backing off, do without it.
bool Cycle::needs_force() const noexcept {
  const Phase phase = supervisor_.phase();
  return phase != Phase::holding && !(phase == Phase::enabling && tared_) &&
         !(phase == Phase::freeing && parts_.freeing->backs_off());
}

void Cycle::judge_lateness(bool late) noexcept {
  if (late) {
    late_score_ += late_sample;
  } else if (late_score_ > 0) {
    --late_score_;
  }
  late_score_ = std::min(late_score_, 2 * late_limit);
  if (!supervisor_.live() || late_score_ <= late_limit) return;
  constexpr double samples = 1.0 / late_sample;
  raise(Fault::sensor_late, -1, samples * late_score_, samples * late_limit);
}

// ---- commands

const char* Cycle::refusal(Order order) const noexcept {
  const Phase phase = shown_phase();
  const bool changing = changes_timestep();
  switch (order) {
    case Order::none:
      return nullptr;
    case Order::hold:
      return phase == Phase::rendering || phase == Phase::freeing || changing ? nullptr : "the arm isn't moving";
    case Order::reset:
      if (phase != Phase::faulted) return "no stop by a fault waits for a reset";
      if (changing) return "the drives haven't all confirmed their timestep: where it lasts, start anew";
      break;
    case Order::release:
    case Order::back_off:
      if (changing) return "the timestep is being changed: again in a moment";
      [[fallthrough]];
    case Order::resume:
      if (phase != Phase::holding) return "the arm isn't in a hold";
      if (cause_lasts_.load(std::memory_order_relaxed)) return "what it is held for is still there";
      break;
  }
  return pressed_.load(std::memory_order_relaxed) ? nullptr : "the enabling input isn't pressed";
}

void Cycle::take_command(std::int64_t t_k_ns) noexcept {
  Command command;
  if (next_scripted_ < scripted_.size() && scripted_[next_scripted_].after_ns <= t_k_ns - first_cycle_ns_) {
    command = scripted_[next_scripted_++].command;
  } else if (!commands_.pop(command)) {
    return;
  }
  if (box_ != nullptr) boxed_->command = command;
  obey(command);
}

bool Cycle::may_move() const noexcept {
  return (!parts_.enabling || parts_.enabling->pressed()) &&
         !supervisor_.cause_lasts(cycle_, cycles_of(clear_of_cause_s, settings_.period_s));
}

void Cycle::obey(const Command& command) noexcept {
  const Phase phase = supervisor_.phase();
  switch (command.order) {
    case Order::hold:
      if (parts_.torque) return;
      if (phase == Phase::rendering) supervisor_.hold();
      if (phase == Phase::freeing) supervisor_.handle(Event::freed);
      if (changing()) wants_resume_ = resumes_after_timestep_ = false;
      return;
    case Order::resume:
      if (phase == Phase::holding && may_move()) wants_resume_ = true;
      return;
    case Order::release:
    case Order::back_off:
      return start_freeing(command);
    case Order::reset:
      if (phase == Phase::faulted && may_move() && !changing()) reset();
      return;
    case Order::none:
      return;
  }
}

void Cycle::supervise_hold(std::int64_t t_k_ns) noexcept {
  if (supervisor_.phase() != Phase::holding || entered_phase_ != Phase::holding) return;
  if (wants_resume_ && stands() && may_move() && !changing()) {
    supervisor_.handle(Event::resume);
  } else if (since_s(t_k_ns, phase_since_ns_) > parts_.supervision.hold_s) {
    supervisor_.give_up_hold();
  }
}

// ---- holds and stops

// Every joint's last speed, which the cycles to come take to nothing. After a reset the drives stand where they are.
void Cycle::start_run_out(Phase from) noexcept {
  wants_resume_ = false;
  if (from == Phase::enabling) {
    for (Eigen::Index i = 0; i < target_rad_.size(); ++i) target_rad_[i] = parts_.drives[i].drive.target_rad();
    guard_.start(target_rad_);
  }
  double stop_s = settings_.period_s;
  for (Eigen::Index i = 0; i < target_rad_.size(); ++i) {
    const double deceleration = parts_.drives[i].drive.description().max_acceleration_rad_per_s2;
    stop_s = std::max(stop_s, std::abs(guard_.speed_rad_per_s()[i]) / deceleration);
  }
  guard_.follow_from_here();
  run_out_rad_per_s_ = guard_.speed_rad_per_s();
  run_out_scale_ = 1.0;
  run_out_per_cycle_ = settings_.period_s / stop_s;
}

void Cycle::await_reset(std::int64_t t_k_ns) noexcept {
  if (since_s(t_k_ns, phase_since_ns_) > settings_.wait_after_fault_s) supervisor_.handle(Event::stop);
}

void Cycle::reset() noexcept {
  if (past_fault_count_ >= past_faults_.size())
    std::rotate(past_faults_.begin(), past_faults_.begin() + 1, past_faults_.end());
  past_faults_[std::min<std::size_t>(past_fault_count_, past_faults_.size() - 1)] = supervisor_.report();
  ++past_fault_count_;
  supervisor_.reset();
  for (DriveOnBus& axis : parts_.drives) axis.drive.forget_fault();
  for (std::size_t bus = 0; bus < std::min(overflows_before_.size(), parts_.network.bus_count()); ++bus) {
    overflows_before_[bus] = parts_.network.bus(bus).status().receive_overflows;
  }
  missed_samples_ = late_score_ = 0;
}

// ---- speed and force

// The tool's speed limit of this cycle. Where it stands, a lower one holds at once.
void Cycle::limit_speed() noexcept {
  const bool slowed = supervisor_.slowed(cycle_, cycles_of(clear_of_slow_s, settings_.period_s));
  const double most = limits_.max_tool_speed_m_per_s;
  double wanted = slowed ? std::min(parts_.supervision.slow_speed_m_per_s, most) : most;
  if (entered_phase_ == Phase::freeing) wanted = std::min(parts_.freeing->speed_m_per_s(), wanted);
  const double step =
      settings_.period_s * std::min(speed_limit_m_per_s2, 0.25 * limits_.max_tool_acceleration_m_per_s2);
  speed_limit_m_per_s_ = std::clamp(wanted, speed_limit_m_per_s_ - step, speed_limit_m_per_s_ + step);
  if (proxy_W_ == proxy_k1_W_ && guard_.at_rest()) speed_limit_m_per_s_ = std::min(speed_limit_m_per_s_, wanted);
  record_.set(RecordFlag::slowed, entered_phase_ == Phase::rendering && speed_limit_m_per_s_ < most);
}

void Cycle::ramp_in() noexcept {
  if (force_share_ >= 1.0) return;
  const double ramp_s = parts_.supervision.ramp_in_s;
  force_share_ = ramp_s > 0.0 ? std::min(1.0, force_share_ + settings_.period_s / ramp_s) : 1.0;
  record_.set(RecordFlag::ramp_in, force_share_ < 1.0);
}

// ---- getting free

// Away from what was touched last; where nothing was, to where the hand pushes.
void Cycle::start_freeing(const Command& command) noexcept {
  if (supervisor_.phase() != Phase::holding || entered_phase_ != Phase::holding || !stands() || !may_move() ||
      changing())
    return;
  if (command.order == Order::release) {
    parts_.freeing->start_release();
  } else {
    Vec3 n_W = last_normal_W_;
    if (n_W.isZero(0.0) && hand_W_.force.norm() > pinning_force_N) n_W = hand_W_.force.normalized();
    if (n_W.isZero(0.0) || !(command.value > 0.0)) return;
    const Vec3 start_W = parts_.arm->tool_pose(parts_.arm->link_from_motor(target_rad_)).translation();
    parts_.freeing->start_back_off(start_W, n_W, command.value, hand_W_.force);
  }
  supervisor_.handle(Event::free);
}

void Cycle::free_motion() noexcept {
  make_limits();
  const Vec3 v_W = (proxy_W_ - proxy_k1_W_) / settings_.period_s;
  const Vec3 h_W = parts_.freeing->force_W(proxy_W_, v_W, hand_W_.force);
  const WorldStep step = world().step(h_W, step_limits_);
  if (step.fault != ProxyFault::none) return raise(Fault::proxy_not_finite, -1);
  active_.add(step.limits);
  proxy_k1_W_ = proxy_W_;
  proxy_W_ = step.q_W;
  record_.p_hat_W_m = triple(step.p_hat_W);
  follow_proxy();
  if (parts_.freeing->over(proxy_W_, hand_W_.force)) supervisor_.handle(Event::freed);
}

}  // namespace proxarm::controller
