#include "controller/cycle/timestep_change.hpp"

#include <cmath>

namespace proxarm::controller {
namespace {

// Number of cycles at rest without a parameter change before the drives get the new period. At the first SYNC the
// drives latch the last setpoint, at the second SYNC they reach it, and the third cycle is for their answer.
constexpr std::uint8_t cycles_at_rest = 3;

}  // namespace

std::int64_t ns_of(double period_s) noexcept { return std::llround(1e9 * period_s); }

bool plausible(const Timestep& timestep) noexcept { return timestep.period_s >= 1e-5 && timestep.period_s <= 1.0; }

Timestep timestep_of(const SessionSettings& settings) noexcept {
  return {settings.period_s, settings.max_missed_samples, settings.max_repeated_samples, settings.horizon_s};
}

void TimestepChange::begin(const Timestep& from, const Timestep& to, bool resumes, Alarm& alarm) noexcept {
  state_ = {.stage = Stage::coming_to_rest, .wanted = to, .old = from, .resumes = resumes};
  (void)alarm.take_hold();  // discards holds that were raised before this change
}

// If a fault with the reaction `hold` is raised during the change, rendering doesn't continue by itself after the
// change: a person must resume it.
TimestepChange::Step TimestepChange::step(std::int64_t t_k_ns, const Surroundings& surroundings, Alarm& alarm,
                                          CycleRecord& record) noexcept {
  if (!under_way()) return {};
  if (alarm.take_hold()) stay_in_hold();
  exchange_.on_cycle(t_k_ns);
  switch (state_.stage) {
    case Stage::coming_to_rest:
      return come_to_rest(surroundings, record);
    case Stage::telling:
      return tell(surroundings, record);
    case Stage::taking_back:
      return take_back(alarm);
    case Stage::none:
    case Stage::unknown:
      break;
  }
  return {};
}

TimestepChange::Step TimestepChange::come_to_rest(const Surroundings& surroundings, CycleRecord& record) noexcept {
  if (!surroundings.held) return give_up({}, record);
  if (!surroundings.stands || ++state_.rest_cycles <= cycles_at_rest) return {};
  state_.stage = Stage::telling;
  exchange_.tell(ns_of(state_.old.period_s), ns_of(state_.wanted.period_s));
  if (state_.wanted.period_s > state_.old.period_s) return {};
  return {.now = state_.wanted};
}

TimestepChange::Step TimestepChange::tell(const Surroundings& surroundings, CycleRecord& record) noexcept {
  if (exchange_.failed()) return give_up(exchange_.refusal(), record);
  if (!surroundings.held) return give_up({}, record);
  return exchange_.done() ? end(state_.wanted) : Step{};
}

TimestepChange::Step TimestepChange::take_back(Alarm& alarm) noexcept {
  if (exchange_.failed()) {
    state_.stage = Stage::unknown;
    alarm.raise(Fault::timestep_unknown, exchange_.refusal().drive);
    return {};
  }
  return exchange_.done() ? end(state_.old) : Step{};
}

TimestepChange::Step TimestepChange::give_up(const fieldbus::PeriodRefusal& refusal, CycleRecord& record) noexcept {
  record.refused_period_ns = ns_of(state_.wanted.period_s);
  record.timestep_refusal = refusal;
  if (state_.stage == Stage::coming_to_rest) return end({});  // no drive has got the new period
  state_.stage = Stage::taking_back;
  exchange_.take_back();
  return {};
}

TimestepChange::Step TimestepChange::end(std::optional<Timestep> now) noexcept {
  const bool resumes = state_.resumes;
  state_.stage = Stage::none;
  state_.resumes = false;
  return {.now = now, .resumes = resumes};
}

bool TimestepChange::next_request(std::int64_t t_k_ns, std::size_t& bus, fieldbus::CanFrame& frame) noexcept {
  return telling() && exchange_.next_request(t_k_ns, bus, frame);
}

bool TimestepChange::on_frame(std::size_t bus, const fieldbus::CanFrame& frame) noexcept {
  return under_way() && exchange_.on_frame(bus, frame);
}

void TimestepChange::archive(fieldbus::StateArchive& state) noexcept {
  archive_fields(state, state_);
  state(exchange_);
  if (!state.reading()) return;
  const bool known = state_.stage <= Stage::unknown;
  if (!known || (under_way() && !(plausible(state_.wanted) && plausible(state_.old)))) state_.stage = Stage::none;
}

}  // namespace proxarm::controller
