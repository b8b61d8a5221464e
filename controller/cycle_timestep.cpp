// The cycle's part of a change of the timestep: the arm comes to rest, the drives are told, everything that holds T is
// made for the new one, and rendering goes on as after any hold.
//
// As long as the drives are told, the cycle runs at the shorter one of both periods (cia402_period.hpp). What ends it
// before all have confirmed (a drive refuses, a fault, a stop) takes it back, in whatever phase; the drives stand then,
// and a target that doesn't change may come as often as it likes. A drive that confirms nothing any more is the fault
// timestep_unknown, and only a new session, which configures it, goes on.
#include <algorithm>
#include <cmath>

#include "controller/bring_up.hpp"
#include "controller/cycle.hpp"

namespace proxarm::controller {
namespace {

// Without a change of a parameter, too. The last target is latched by the next SYNC and reached by the one after; one
// more for the answer to that.
constexpr std::uint8_t cycles_at_rest = 3;

std::int64_t ns_of(double period_s) noexcept { return std::llround(1e9 * period_s); }

// Read from a file it may be anything.
bool plausible(const Timestep& timestep) noexcept { return timestep.period_s >= 1e-5 && timestep.period_s <= 1.0; }

void set_counts(SessionSettings& settings, const Timestep& timestep) noexcept {
  settings.max_missed_samples = timestep.max_missed_samples;
  settings.max_repeated_samples = timestep.max_repeated_samples;
}

}  // namespace

const char* Cycle::timestep_refusal() const noexcept {
  const Phase phase = shown_phase();
  if (parts_.torque) return "the impedance type's torques are made for one timestep";
  if (!parts_.modbus_lines.empty()) return "what is on a Modbus line keeps the timestep of the start";
  if (changes_timestep()) return "it is being changed already";
  return phase == Phase::rendering || phase == Phase::holding ? nullptr : "the arm is neither rendering nor in a hold";
}

void Cycle::take_timestep() noexcept {
  const Phase phase = supervisor_.phase();
  if ((phase != Phase::rendering && phase != Phase::holding) || changing()) return;
  Timestep wanted;
  if (next_timestep_ < scheduled_timesteps_.size() &&
      scheduled_timesteps_[next_timestep_].rendered_ns <= rendered_ns_) {
    wanted = scheduled_timesteps_[next_timestep_++].timestep;
  } else if (timesteps_.pop(wanted)) {
    ++asked_timesteps_;
  } else {
    return;
  }
  if (box_ != nullptr) boxed_->timestep = wanted;
  if (wanted.period_s == settings_.period_s || !plausible(wanted)) return;
  if (parts_.torque || !parts_.modbus_lines.empty()) return;
  wanted_timestep_ = wanted;
  old_timestep_ = {settings_.period_s, settings_.max_missed_samples, settings_.max_repeated_samples};
  timestep_stage_ = TimestepStage::coming_to_rest;
  resumes_after_timestep_ = phase == Phase::rendering || wants_resume_;
  rest_cycles_ = 0;
  if (phase == Phase::rendering) supervisor_.hold();
}

void Cycle::change_timestep(std::int64_t t_k_ns) noexcept {
  if (!changing()) return;
  const bool held = supervisor_.phase() == Phase::holding;
  exchange_.on_cycle(t_k_ns);
  switch (timestep_stage_) {
    case TimestepStage::none:
    case TimestepStage::unknown:
      return;
    case TimestepStage::coming_to_rest:
      if (!held) return take_timestep_back({});
      if (entered_phase_ != Phase::holding || !stands()) return;
      if (++rest_cycles_ > cycles_at_rest) begin_telling();
      return;
    case TimestepStage::telling:
      if (exchange_.failed()) return take_timestep_back(exchange_.refusal());
      if (!held) return take_timestep_back({});
      if (!exchange_.done()) return;
      set_counts(settings_, wanted_timestep_);
      apply_period(wanted_timestep_.period_s);
      return end_timestep();
    case TimestepStage::taking_back:
      if (exchange_.failed()) {
        timestep_stage_ = TimestepStage::unknown;
        return raise(Fault::timestep_unknown, exchange_.refusal().drive);
      }
      if (!exchange_.done()) return;
      set_counts(settings_, old_timestep_);
      apply_period(old_timestep_.period_s);
      return end_timestep();
  }
}

void Cycle::begin_telling() noexcept {
  timestep_stage_ = TimestepStage::telling;
  exchange_.tell(ns_of(old_timestep_.period_s), ns_of(wanted_timestep_.period_s));
  if (wanted_timestep_.period_s > settings_.period_s) return;
  set_counts(settings_, wanted_timestep_);
  apply_period(wanted_timestep_.period_s);
}

void Cycle::take_timestep_back(const fieldbus::PeriodRefusal& refusal) noexcept {
  record_.refused_period_ns = ns_of(wanted_timestep_.period_s);
  record_.timestep_refusal = refusal;
  if (timestep_stage_ == TimestepStage::coming_to_rest) return end_timestep();  // nobody was told anything
  timestep_stage_ = TimestepStage::taking_back;
  exchange_.take_back();
}

void Cycle::end_timestep() noexcept {
  timestep_stage_ = TimestepStage::none;
  wants_resume_ = wants_resume_ || resumes_after_timestep_;
  resumes_after_timestep_ = false;
}

// After all of the cycle's own frames, so that none waits for more than the one that is on the wire.
void Cycle::send_period_requests(std::int64_t t_k_ns) noexcept {
  fieldbus::CanFrame frame;
  std::size_t bus = 0;
  while (telling() && exchange_.next_request(t_k_ns, bus, frame)) send(bus, frame);
}

// For an arm that stands. What was commanded, measured and rendered stays as it is; what is made of T is made anew, and
// what is counted in cycles back from now is counted in the new ones.
void Cycle::apply_period(double period_s) noexcept {
  const double ratio = settings_.period_s / period_s;
  if (ratio != 1.0) supervisor_.rescale(cycle_, ratio);
  moved_rad_ /= ratio;
  stale_cycles_ *= ratio;
  settings_.period_s = period_s;
  period_ns_ = ns_of(period_s);
  receive_window_ns_ = std::llround(receive_window * period_s * 1e9);
  if (parts_.inverse) parts_.inverse->set_max_step(max_steps_rad(parts_.drives, period_s));
  parts_.elastic.set_period(period_s);
  parts_.orientation.set_period(period_s);
  if (parts_.world) parts_.world->set_period(period_s);
  if (parts_.freeing) parts_.freeing->set_period(period_s);
  if (passivity_) passivity_->set_period(period_s);
  limiter_.set_period(period_s);
  guard_.set_period(period_s);
}

void Cycle::archive_timestep(fieldbus::StateArchive& state) noexcept {
  Timestep now{settings_.period_s, settings_.max_missed_samples, settings_.max_repeated_samples};
  for (Timestep* timestep : {&now, &wanted_timestep_, &old_timestep_}) {
    state(timestep->period_s, timestep->max_missed_samples, timestep->max_repeated_samples);
  }
  state(exchange_, timestep_stage_, resumes_after_timestep_, rest_cycles_);
  if (!state.reading()) return;
  if (timestep_stage_ > TimestepStage::unknown ||
      (changing() && !(plausible(wanted_timestep_) && plausible(old_timestep_))))
    timestep_stage_ = TimestepStage::none;
  if (!plausible(now)) return;
  set_counts(settings_, now);
  if (now.period_s != settings_.period_s) apply_period(now.period_s);
}

}  // namespace proxarm::controller
