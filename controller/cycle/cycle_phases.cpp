// Contains Cycle's actions in each phase of a session, and at the beginning of each phase.
#include <algorithm>
#include <bit>
#include <optional>

#include "controller/cycle/cycle.hpp"

namespace proxarm::controller {
namespace {

// Time for the drives to switch off. After this time the session ends with Fault::drive_not_disabled.
constexpr std::int64_t disable_timeout_ns = 1'000'000'000;
// An arm without power counts as standing when all encoders have been slower than this for standing_ns.
constexpr double standing_rad_per_s = 0.01;
constexpr std::int64_t standing_ns = 200'000'000;
// Twice the time that yielding by 20 mm at 0.05 m/s takes, acceleration included.
constexpr std::int64_t longest_yield_ns = 1'000'000'000;
// The tool stays slow for this time after the last fault with reaction `slow`.
constexpr double clear_of_slow_s = 0.5;

}  // namespace

void Cycle::enter(Phase phase, std::int64_t t_k_ns) noexcept {
  const Phase from = state_.entered_phase;
  if (phase == from) return;
  state_.entered_phase = phase;
  state_.phase_since_ns = t_k_ns;
  bus_.request(goal_in(phase));
  switch (phase) {
    case Phase::rendering:
      return motion_->start(measurement_.now(), from == Phase::holding ? Beginning::resuming : Beginning::first);
    case Phase::freeing:
      return motion_->start(measurement_.now(), Beginning::freeing);
    case Phase::taring:
      return measurement_.start_tare();
    case Phase::holding:
    case Phase::stopping:
      state_.wants_resume = false;
      state_.awaits_rest = {};
      state_.yields = state_.yielded = false;
      return motion_->start_run_out();
    default:
      return;
  }
}

// Returns the goal of the drives in a phase. After a stop of category 0, or a stop that was turned into one, drives
// lose power at once (goal `none`) and don't get power again. After other stops they ramp down by themselves.
fieldbus::DriveGoal Cycle::goal_in(Phase phase) const noexcept {
  if (phase < Phase::disabling) return fieldbus::DriveGoal::operation_enabled;
  return supervisor_.cuts_power() ? fieldbus::DriveGoal::none : fieldbus::DriveGoal::switched_off;
}

void Cycle::act(std::int64_t t_k_ns) noexcept {
  switch (supervisor_.phase()) {
    case Phase::idle:
      return await_begin(t_k_ns);
    case Phase::enabling:
      return await_enabled(t_k_ns);
    case Phase::taring:
      return tare(t_k_ns);
    case Phase::rendering:
      take_change();
      return render();
    case Phase::holding:
      take_change();
      return motion_->run_out();
    case Phase::freeing:
      return free();
    case Phase::stopping:
      return run_out(t_k_ns);
    case Phase::disabling:
      return await_disabled(t_k_ns);
    case Phase::faulted:
      return await_reset(t_k_ns);
    case Phase::done:
      return;
  }
}

double Cycle::in_phase_s(std::int64_t t_k_ns) const noexcept {
  return 1e-9 * static_cast<double>(t_k_ns - state_.phase_since_ns);
}

void Cycle::await_begin(std::int64_t t_k_ns) noexcept {
  const double waited_s = 1e-9 * static_cast<double>(t_k_ns - state_.first_cycle_ns);
  if (waited_s > settings_.enabling_timeout_s) alarm_.raise(Fault::enabling_not_pressed);
}

void Cycle::await_enabled(std::int64_t t_k_ns) noexcept {
  const Measured& measured = measurement_.now();
  motion_->wait_for_drives(measured);
  if (std::countr_one(measured.following) >= static_cast<int>(measured.axes())) {
    supervisor_.handle(state_.tared ? Event::reenabled : Event::enabled);
    return;
  }
  const double waited_s = in_phase_s(t_k_ns);
  const OverdueDrive overdue = first_overdue(parts_.drives, measured.following, waited_s, settings_.enable_timeout_s);
  if (overdue.drive >= 0) alarm_.raise(Fault::drive_not_enabled, overdue.drive, waited_s, overdue.limit_s);
}

void Cycle::tare(std::int64_t t_k_ns) noexcept {
  motion_->stand(measurement_.now());
  if (!measurement_.tare(settings_, in_phase_s(t_k_ns), alarm_)) return;
  if (const std::optional<MissingWeight> missing = motion_->missing_weight()) {
    alarm_.raise(Fault::weight_unknown, missing->joint, missing->torque_Nm, missing->limit_Nm);
    return;
  }
  state_.tared = true;
  supervisor_.handle(settings_.only_tares ? Event::stop : Event::tared);
}

MotionCycle Cycle::motion_cycle() noexcept {
  return {.measured = measurement_.now(),
          .slowed = supervisor_.slowed(state_.cycle, cycles_of(clear_of_slow_s)),
          .alarm = alarm_,
          .record = recorder_.record()};
}

void Cycle::render() noexcept {
  if (!motion_->render(motion_cycle())) return;
  ++state_.rendered_cycles;
  state_.rendered_ns += period_ns();
  if (const models::Wrench* const rest_W = motion_->resting_wrench_W()) measurement_.follow_bias(*rest_W);
  if (motion_->wants_hold()) supervisor_.hold();
}

void Cycle::free() noexcept {
  if (motion_->free(motion_cycle())) supervisor_.handle(Event::freed);
}

void Cycle::run_out(std::int64_t t_k_ns) noexcept {
  if (state_.yields) return yield(t_k_ns);
  motion_->run_out();
  if (!motion_->stands()) return;
  if (may_yield() && motion_->start_yielding(measurement_.now())) {
    state_.yields = true;
    state_.yields_since_ns = t_k_ns;
  } else {
    supervisor_.handle(Event::at_rest);
  }
}

// Yields after a stop because of an excessive force: if the brakes closed first, the arm would keep pressing.
void Cycle::yield(std::int64_t t_k_ns) noexcept {
  const bool over = motion_->free(motion_cycle());
  if (!over && may_yield() && t_k_ns - state_.yields_since_ns <= longest_yield_ns) return;
  state_.yields = false;
  state_.yielded = true;
  motion_->start_run_out();
}

bool Cycle::may_yield() const noexcept {
  return supervisor_.report().fault == Fault::force_excessive && !state_.yielded &&
         (!parts_.enabling || parts_.enabling->pressed());
}

void Cycle::await_disabled(std::int64_t t_k_ns) noexcept {
  bus_.request(goal_in(Phase::disabling));  // the goal may have changed during this phase
  const bool off = bus_.drives_off(), in_time = t_k_ns - state_.phase_since_ns <= disable_timeout_ns;
  if (in_time && (!off || runs_down(t_k_ns))) return;
  if (!off) alarm_.raise(Fault::drive_not_disabled, bus_.first_drive_on());
  const bool waits = supervisor_.faulted() && settings_.wait_after_fault_s > 0.0 && off &&
                     !recorder_.entry().stop_requested && motion_->can_hold();
  supervisor_.handle(waits ? Event::wait : Event::disabled);
}

// Whether an arm without power moves by its encoders, or has moved within standing_ns. Brakes and gears need time until
// the arm stands, and the record continues until then.
bool Cycle::runs_down(std::int64_t t_k_ns) noexcept {
  if (!supervisor_.cuts_power()) return false;
  const double most_rad = standing_rad_per_s * settings_.period_s;
  if (measurement_.now().jump_rad.cwiseAbs().maxCoeff() > most_rad) state_.moved_ns = t_k_ns;
  return t_k_ns - std::max(state_.moved_ns, state_.phase_since_ns) <= standing_ns;
}

void Cycle::await_reset(std::int64_t t_k_ns) noexcept {
  if (in_phase_s(t_k_ns) > settings_.wait_after_fault_s) supervisor_.handle(Event::stop);
}

}  // namespace proxarm::controller
